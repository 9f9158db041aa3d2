// Spectrum and damping on demand.

/** Returns the part of a curve between two times, without values that are not finite. */
function part(trace, from, to) {
  const [t, y] = [column(trace.t), column(trace.y)];
  const kept = [...t.keys()].filter((i) => t[i] >= from && t[i] <= to && Number.isFinite(y[i]));
  return [kept.map((i) => t[i]), kept.map((i) => y[i])];
}

/** Returns the rows of results of a part of a curve. */
function resultsOf(t, y) {
  const rows = [];
  const decrement = decrementOf(t, y);
  if (decrement) {
    const { frequency, cycles, error } = decrement;
    rows.push(["frequency, from the extremes", withUnit(frequency, "Hz")]);
    rows.push([`logarithmic decrement, ${cycles} cycles`, `${shown(decrement.decrement, 4)} ± ${shown(error, 2)}`]);
    rows.push(["damping ratio, from the decrement", shown(decrement.ratio, 4) + (decrement.ratio < 0 ? " (grows)" : "")]);
  } else {
    rows.push(["logarithmic decrement", "requires two cycles of an oscillation"]);
  }
  const width = halfPowerOf(t, y);
  if (width) {
    rows.push(["frequency of the highest peak", withUnit(width.frequency, "Hz")]);
    rows.push(["damping ratio, from the width at half power", width.resolved ? shown(width.ratio, 4) : `not resolved: below ${shown(width.ratio, 2)}`]);
  }
  return rows;
}

/** Starts the analysis of the recorded curves. */
function startAnalysis(place, traces) {
  const choice = element("select", { name: "trace" }, ...traces.map(({ name }, i) => element("option", { value: i }, name)));
  const [from, to] = ["from", "to"].map((name) => element("input", { name, type: "number", step: "any" }));
  const [curve, spectrum] = [0, 1].map(() => element("div", { className: "chart" }));
  const results = element("table", { className: "results" });
  const update = () => {
    const trace = traces[choice.value];
    const [t, y] = part(trace, Number(from.value), Number(to.value));
    if (t.length < 8) {
      results.replaceChildren(element("tr", {}, element("td", {}, "The part has fewer than 8 rows.")));
      return;
    }
    const { frequency, amplitude } = spectrumOf(t, y);
    const chart = (x, label) => ({ x, y: { label, unit: trace.unit, log: false }, series: [{ lines: true, name: "" }] });
    const show = (element, described, x, y) => {
      const layout = layoutOf(described);
      const text = `%{x:.6g} ${described.x.unit}, %{y:.6g} ${trace.unit}<extra></extra>`;
      Plotly.react(element, [{ type: "scatter", x, y, line: { width: 1.5 }, hovertemplate: text }], layout, OPTIONS);
    };
    show(curve, chart({ label: "<i>t</i>", unit: "s" }, trace.label), t, y);
    const described = chart({ label: "frequency", unit: "Hz" }, `amplitude of ${trace.label}`);
    described.y.log = true;
    show(spectrum, described, frequency, amplitude);
    results.replaceChildren(...resultsOf(t, y).map((row) => element("tr", {}, ...row.map((text) => element("td", {}, text)))));
  };
  const restart = () => {
    const t = column(traces[choice.value].t);
    [from.value, to.value] = [t[0], t[t.length - 1]];
    update();
  };
  choice.addEventListener("change", restart);
  [from, to].forEach((input) => input.addEventListener("change", update));
  place.append(
    element("div", { className: "tools" }, labeled("Curve", choice), labeled("from", from), labeled("to", to), "s"),
    element("div", { className: "beside" }, curve, spectrum),
    results,
    element("p", { className: "note" }, "Amplitudes by a Hann window. Both damping ratios are meaningful only for a free decay of one mode: choose the part of the curve after the load ends."),
  );
  place.closest("details").addEventListener("toggle", restart, { once: true });
}
