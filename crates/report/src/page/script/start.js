// Reads the page's data and starts the interactive parts. Without JavaScript the page keeps its tables and pictures.
"use strict";

const DATA = JSON.parse(document.getElementById("data").textContent);

/** Decodes base64 into an array of a type. */
function decode(Type, text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return new Type(bytes.buffer);
}

const columns = new Map();

/** Returns a column of numbers, decoded once. */
function column(number) {
  if (!columns.has(number)) {
    const { type, data } = DATA.columns[number];
    columns.set(number, decode(type === "f8" ? Float64Array : Float32Array, data));
  }
  return columns.get(number);
}

/** Creates an element with properties and children. */
function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Creates a labeled control. */
const labeled = (text, control) => element("label", {}, text + " ", control);

/** Formats a number with `digits` significant digits. */
function shown(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  return size === 0 || (size >= 1e-3 && size < 1e6) ? String(rounded) : rounded.toExponential();
}

/** Formats a number with its unit. */
const withUnit = (value, unit) => shown(value) + (unit ? " " + unit : "");

/** Returns a color of the page's style. */
const styleColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Loads the chart library, which the page contains compressed. */
async function loadLibrary() {
  const packed = document.getElementById("library");
  if (!packed) return false;
  const bytes = decode(Uint8Array, packed.textContent);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = element("script", { textContent: await new Response(stream).text() });
  document.head.append(script);
  script.remove();
  return true;
}
