// Controls of the view of the body.

/** Turns, shifts and scales the view with the pointer. */
function followPointer(view, readout) {
  const { canvas } = view;
  let last = null;
  canvas.addEventListener("pointerdown", (event) => {
    last = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointerup", () => {
    last = null;
    view.draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return readout(view.pick(event.offsetX, event.offsetY));
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    last = [event.clientX, event.clientY];
    if (event.shiftKey || event.buttons === 2) {
      view.shift = [view.shift[0] + (2 * dx) / canvas.clientWidth, view.shift[1] - (2 * dy) / canvas.clientHeight];
    } else {
      view.turn = multiply(rotation(0, dy / 150), multiply(rotation(1, dx / 150), view.turn));
    }
    view.draw(true);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => (view.reset(), view.draw()));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom *= Math.exp(-event.deltaY / 500);
    view.draw();
  }, { passive: false });
}

/** Returns the names of everything that can color the body. */
function choices(body) {
  const found = body.fields.flatMap((field) => {
    const parts = field.components.map((component, c) => ({ name: `${field.name} ${component}`.trim(), field, c }));
    return field.moves || field.is_vector ? [{ name: `${field.name}, magnitude`, field, c: -1 }, ...parts] : parts;
  });
  return body.materials.length > 1 || !found.length ? [...found, { name: "material", field: null }] : found;
}

/** Shows the colors with their limits, or the materials. */
function legendOf(view) {
  if (!view.field) {
    return view.body.materials.map(({ name, color }) => {
      const swatch = element("span", { className: "swatch" });
      swatch.style.background = color;
      return element("span", {}, swatch, name);
    });
  }
  const bar = element("span", { className: "colors" });
  bar.style.background = `linear-gradient(to right,${view.body.colors.join()})`;
  const { unit } = view.field;
  return [withUnit(view.range[0], unit), bar, withUnit(view.range[1], unit)];
}

/** Starts the view of a body in a place of the page. */
function startBody(place, body) {
  const canvas = element("canvas", { className: "body", tabIndex: 0 });
  canvas.setAttribute("aria-label", "The body; drag to turn");
  place.append(canvas);
  const view = new BodyView(canvas, body);
  place.querySelectorAll("figure").forEach((figure) => figure.remove());
  const legend = element("div", { className: "legend" });
  const readout = element("div", { className: "readout" });
  const describe = (i) => {
    const at = i < 0 ? [] : [0, 1, 2].slice(0, body.dimension).map((k) => shown(view.points[3 * i + k], 4));
    const value = view.field ? withUnit(view.values[i], view.field.unit) : "";
    readout.textContent = i < 0 ? "Drag to turn, Shift and drag to move, wheel to zoom, double-click to reset" : `${value} at (${at.join(", ")}) m of the body at rest`;
  };
  followPointer(view, describe);
  describe(-1);

  const all = choices(body);
  const quantity = element("select", { name: "quantity" }, ...all.map(({ name }, i) => element("option", { value: i }, name)));
  const select = () => {
    const { field, c } = all[quantity.value];
    view.select(field, c);
    legend.replaceChildren(...legendOf(view));
  };
  quantity.addEventListener("change", select);
  const factor = element("input", { name: "factor", type: "number", step: "any", value: 1 });
  factor.addEventListener("input", () => {
    view.factor = Number(factor.value);
    view.draw();
  });
  const edges = element("input", { name: "edges", type: "checkbox", checked: true });
  edges.addEventListener("change", () => {
    view.edges = edges.checked;
    view.draw();
  });
  const views = Object.entries(VIEWS).map(([name, turn]) => {
    const button = element("button", { type: "button" }, name);
    button.addEventListener("click", () => {
      view.reset(turn);
      view.draw();
    });
    return button;
  });
  const moves = body.fields.some((field) => field.moves);
  place.prepend(element("div", { className: "tools" }, labeled("Color", quantity), ...(moves ? [labeled("Deformation ×", factor)] : []), labeled("Mesh", edges), ...views));
  place.append(legend, readout, ...(body.labels.length > 1 || body.oscillates ? [timeControls(view, select)] : []));
  select();
  new ResizeObserver(() => view.draw()).observe(canvas);
}

/** Returns the slider of times or the list of modes, and the button that plays them. */
function timeControls(view, refresh) {
  const { body } = view;
  const last = body.labels.length - 1;
  const slider = element("input", { name: "frame", type: "range", min: 0, max: last, value: view.frame });
  const label = element("output", {}, body.labels[view.frame]);
  const list = element("select", { name: "frame" }, ...body.labels.map((text, i) => element("option", { value: i }, text)));
  const chooser = body.oscillates ? list : slider;
  let start = null;
  const show = (frame) => {
    chooser.value = frame;
    label.textContent = body.labels[frame];
    view.frame = Number(frame);
    if (body.oscillates) refresh();
    else view.update(start !== null);
  };
  chooser.addEventListener("input", () => show(chooser.value));
  const button = element("button", { type: "button", name: "play" }, "Play");
  const step = (now) => {
    if (start === null) return;
    if (body.oscillates) {
      view.phase = Math.cos((2 * Math.PI * (now - start)) / 1500);
      view.draw(true);
    } else {
      const frame = Math.floor((now - start) / 60) % (last + 1);
      if (frame !== view.frame) show(frame);
    }
    requestAnimationFrame(step);
  };
  button.addEventListener("click", () => {
    const plays = start === null;
    button.textContent = plays ? "Pause" : "Play";
    start = plays ? performance.now() - (body.oscillates ? 0 : 60 * view.frame) : null;
    if (plays) requestAnimationFrame(step);
    else view.draw();
  });
  return element("div", { className: "tools" }, button, chooser, ...(body.oscillates ? [] : [label]));
}
