const problems = [];
addEventListener("error", (event) => problems.push(String(event.message)));
addEventListener("unhandledrejection", (event) => problems.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => problems.push(`${event.violatedDirective} ${event.blockedURI}`));
console.error = (...words) => problems.push(words.join(" "));

const wait = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Draws the body again and returns the picture. */
function picture() {
  const canvas = document.querySelector("canvas.body");
  canvas.dispatchEvent(new PointerEvent("pointerup", {}));
  return canvas.toDataURL();
}

/** Returns whether an action changes the picture of the body. */
async function changes(action) {
  const before = picture();
  await action();
  return picture() !== before;
}

/** Changes the value of a control. */
function set(name, value) {
  const control = document.querySelector(`.view [name=${name}]`);
  control.value = value;
  control.dispatchEvent(new Event("input"));
  control.dispatchEvent(new Event("change"));
}

/** Uses the controls of the body. */
async function useBody(seen) {
  const canvas = document.querySelector("canvas.body");
  const frames = document.querySelector(".view [name=frame]");
  seen.frames = frames ? (frames.options ? frames.options.length : Number(frames.max) + 1) : 0;
  seen.changes = {};
  if (frames) {
    const last = seen.frames - 1;
    seen.changes.slider = await changes(() => set("frame", Number(frames.value) === last ? 0 : last));
    set("frame", last);
  }
  if (document.querySelector(".view [name=factor]")) seen.changes.factor = await changes(() => set("factor", 40));
  seen.changes.color = await changes(() => set("quantity", 1));
  seen.changes.turned = await changes(() => {
    // A synthetic pointer cannot be captured.
    canvas.setPointerCapture = () => {};
    canvas.dispatchEvent(new PointerEvent("pointerdown", { clientX: 100, clientY: 100 }));
    canvas.dispatchEvent(new PointerEvent("pointermove", { clientX: 180, clientY: 130, buttons: 1 }));
  });
  const play = document.querySelector(".view [name=play]");
  if (play) {
    const before = picture();
    play.click();
    // The time at which a frame is shown depends on the machine.
    for (let i = 0; i < 40 && !seen.changes.played; i++) {
      await wait(25);
      seen.changes.played = picture() !== before;
    }
    play.click();
  }
}

/** Analyzes a decay of 8 Hz and a damping ratio of 2 % about a position of rest, and a sine of 10 Hz and amplitude 0.25. */
function analyzed() {
  const times = (n, end) => Array.from({ length: n }, (_, i) => (i * end) / n);
  const [t, ratio, omega] = [times(1500, 6), 0.02, 2 * Math.PI * 8];
  const rate = (ratio * omega) / Math.sqrt(1 - ratio * ratio);
  const decay = t.map((t) => 0.3 + 1e-3 * Math.exp(-rate * t) * Math.cos(omega * t));
  const [s, sine] = [times(4096, 2), (t) => 7 + 0.25 * Math.sin(20 * Math.PI * t)];
  const { frequency, amplitude } = spectrumOf(s, s.map(sine));
  const highest = amplitude.indexOf(Math.max(...amplitude));
  return {
    decrement: decrementOf(t, decay),
    width: halfPowerOf(t, decay),
    short: halfPowerOf(t.slice(0, 200), decay.slice(0, 200)),
    peak: [frequency[highest], amplitude[highest]],
  };
}

async function explore() {
  const root = document.documentElement;
  for (let i = 0; i < 200 && root.dataset.state !== "ready"; i++) await wait(50);
  const details = document.querySelector("[data-analysis]")?.closest("details");
  if (details) details.open = true;
  await wait(2000);
  const charts = [...document.querySelectorAll(".js-plotly-plot")];
  const seen = { state: root.dataset.state, images: document.querySelectorAll("img").length };
  seen.charts = charts.filter((chart) => chart.querySelector(".trace path, .trace .point")).length;
  const curves = charts.filter((chart) => chart.closest("[data-charts]") && chart._fullLayout.xaxis.title.text.includes("<i>t</i>"));
  if (curves.length > 1) {
    await Plotly.relayout(curves[0], { "xaxis.range": [0.01, 0.02] });
    await wait(200);
    seen.linked = curves.every((chart) => chart.layout.xaxis.range[1] === 0.02);
  }
  const several = curves.filter((chart) => chart.data.length > 1);
  if (several.length > 1) {
    several[0].emit("plotly_click", { points: [{ data: several[0].data[0] }] });
    await wait(200);
    seen.highlighted = several.every((chart) => chart.data[0].opacity === 1 && chart.data[1].opacity < 1);
  }
  if (document.querySelector("canvas.body")) await useBody(seen);
  seen.rows = [...document.querySelectorAll(".results tr")].map((row) => row.innerText);
  seen.analyzed = analyzed();
  seen.problems = problems;
  root.dataset.seen = JSON.stringify(seen);
}

addEventListener("DOMContentLoaded", () => explore().catch((error) => {
  problems.push(String(error));
  document.documentElement.dataset.seen = JSON.stringify({ problems });
}));
