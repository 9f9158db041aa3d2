// The body: turned with the pointer, colored by a stored quantity, deformed by a factor, and played over time.

const VERTEX = `#version 300 es
in vec3 rest; in vec3 u; in float value;
uniform mat3 turn; uniform vec3 center; uniform vec4 scale; uniform vec2 shift; uniform float factor; uniform vec2 range;
out float fraction; out vec3 place;
void main() {
  place = turn * (rest + factor * u - center);
  fraction = range.y > range.x ? (value - range.x) / (range.y - range.x) : 0.5;
  gl_Position = vec4(place.xy * scale.xy + shift, -place.z * scale.z + scale.w, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in float fraction; in vec3 place;
uniform sampler2D map; uniform vec4 line; uniform bool lit;
out vec4 color;
void main() {
  if (line.a > 0.0) { color = line; return; }
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = lit ? 0.45 + 0.55 * abs(normal.z) : 1.0;
  // Values that are not finite are gray.
  vec3 hue = fraction > 1e6 || fraction < -1e6 ? vec3(0.5) : texture(map, vec2(fraction, 0.5)).rgb;
  color = vec4(light * hue, 1.0);
}`;

/** Largest stored number; the number above it stands for values that are not finite. */
const LEVELS = 65534;

/** Number of ends of lines from which a mesh is fine. */
const FINE = 20000;

/** The stored states of the body. */
class States {
  constructor(body) {
    this.body = body;
    this.n = decode(Float32Array, body.points).length / 3;
    this.cache = new Map();
  }

  /** Returns the component `c` of a field in a frame. */
  component(field, c, frame) {
    const key = `${field.name} ${c} ${frame}`;
    if (!this.cache.has(key)) {
      const { lowest, highest } = field.ranges[c];
      const step = (highest - lowest) / LEVELS;
      const levels = decode(Uint16Array, field.frames[frame][c]);
      this.cache.set(key, Float32Array.from(levels, (level) => (level > LEVELS ? 1e30 : lowest + step * level)));
    }
    return this.cache.get(key);
  }

  /** Returns the values of a field: a component, or the magnitude for `c` = -1. */
  values(field, c, frame) {
    if (c >= 0) return this.component(field, c, frame);
    const parts = field.ranges.map((_, k) => this.component(field, k, frame));
    return Float32Array.from(parts[0], (_, i) => Math.hypot(...parts.map((part) => part[i])));
  }

  /** Returns the displacements of all points in a frame. */
  displacement(frame) {
    const moved = new Float32Array(3 * this.n);
    const field = this.body.fields.find((field) => field.moves);
    if (!field) return moved;
    for (let c = 0; c < 3; c++) {
      const part = this.component(field, c, frame);
      for (let i = 0; i < this.n; i++) moved[3 * i + c] = part[i] < 1e29 ? part[i] : 0;
    }
    return moved;
  }

  /** Returns the range of a field over all frames, or over one frame if these cannot be compared. */
  range(field, c, frame) {
    if (c >= 0 && !this.body.oscillates) return [field.ranges[c].lowest, field.ranges[c].highest];
    let [lowest, highest] = [Infinity, -Infinity];
    for (let k = 0; k < field.frames.length; k++) {
      if (this.body.oscillates && k !== frame) continue;
      for (const value of this.values(field, c, k)) {
        if (value < 1e29) [lowest, highest] = [Math.min(lowest, value), Math.max(highest, value)];
      }
    }
    return [c < 0 ? 0 : lowest, highest];
  }
}

/** A view of the body on a canvas. */
class BodyView {
  constructor(canvas, body) {
    const frame = body.oscillates ? 0 : Math.max(0, body.labels.length - 1);
    Object.assign(this, { canvas, body, states: new States(body), frame, factor: 1, phase: 1, edges: true });
    this.gl = canvas.getContext("webgl2", { antialias: true });
    if (!this.gl) throw new Error("WebGL 2 is not available");
    this.points = decode(Float32Array, body.points);
    this.triangles = decode(Uint32Array, body.triangles);
    this.lines = decode(Uint32Array, body.edges);
    this.prepare();
    this.reset();
  }

  prepare() {
    const { gl } = this;
    const shader = (type, text) => {
      const made = gl.createShader(type);
      gl.shaderSource(made, text);
      gl.compileShader(made);
      return made;
    };
    this.program = gl.createProgram();
    gl.attachShader(this.program, shader(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(this.program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(this.program));
    gl.useProgram(this.program);
    const array = (name, size, content) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, content, gl.DYNAMIC_DRAW);
      const place = gl.getAttribLocation(this.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
      return buffer;
    };
    array("rest", 3, this.points);
    this.buffers = { u: array("u", 3, this.points), value: array("value", 1, new Float32Array(this.states.n)) };
    const indices = (content) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, content, gl.STATIC_DRAW);
      return buffer;
    };
    this.indices = { triangles: indices(this.triangles), lines: indices(this.lines) };
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** Shows the whole body from a direction, by default the first one. */
  reset(turn = this.body.dimension === 3 ? VIEWS.oblique : VIEWS["x–y"]) {
    const [low, high] = [[...this.points.slice(0, 3)], [...this.points.slice(0, 3)]];
    for (let i = 0; i < this.points.length; i++) {
      low[i % 3] = Math.min(low[i % 3], this.points[i]);
      high[i % 3] = Math.max(high[i % 3], this.points[i]);
    }
    const half = low.map((x, i) => (high[i] - x) / 2);
    this.center = low.map((x, i) => x + half[i]);
    this.radius = Math.hypot(...half) || 1;
    // Half the width and the height of the body in the view.
    this.extent = turn.slice(0, 2).map((row) => Math.abs(row[0]) * half[0] + Math.abs(row[1]) * half[1] + Math.abs(row[2]) * half[2]);
    Object.assign(this, { turn, zoom: 1, shift: [0, 0] });
  }

  /** Selects a field and its component, or the materials without a field. */
  select(field, c) {
    Object.assign(this, { field, c });
    this.update();
  }

  /** Passes the state of the frame to the graphics processor. */
  update(moving = false) {
    const { gl, field, c, body, states, frame } = this;
    this.u = states.displacement(frame);
    this.values = field ? states.values(field, c, frame) : Float32Array.from(decode(Uint8Array, body.material));
    this.range = field ? states.range(field, c, frame) : [-0.5, body.materials.length - 0.5];
    for (const [name, content] of [["u", this.u], ["value", this.values]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, content, gl.DYNAMIC_DRAW);
    }
    const colors = field ? body.colors : body.materials.map((material) => material.color);
    const pixels = colors.flatMap((color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16)));
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, colors.length, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(pixels));
    const filter = field ? gl.LINEAR : gl.NEAREST;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    this.draw(moving);
  }

  /** Returns the scales of x and y: at first the body fills 85 % of the canvas. */
  scales() {
    const { width, height } = this.canvas;
    const [x, y] = this.extent.map((half) => Math.max(half, 0.01 * this.radius));
    const size = 0.85 * this.zoom * Math.min(width / x, height / y);
    return [size / width, size / height];
  }

  /** Draws the body; `moving` leaves out the lines of a fine mesh, which cost most. */
  draw(moving = false) {
    const { gl, canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.round(n * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const uniform = (name) => gl.getUniformLocation(this.program, name);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix3fv(uniform("turn"), true, this.turn.flat());
    gl.uniform3fv(uniform("center"), this.center);
    gl.uniform2fv(uniform("shift"), this.shift);
    gl.uniform1f(uniform("factor"), this.factor * this.phase);
    gl.uniform2fv(uniform("range"), this.range);
    gl.uniform1i(uniform("lit"), this.body.dimension === 3 ? 1 : 0);
    const part = (buffer, kind, count, line, nearer) => {
      gl.uniform4f(uniform("line"), ...line);
      // Lines are drawn slightly nearer than the triangles.
      gl.uniform4f(uniform("scale"), ...this.scales(), 0.2 / this.radius, nearer);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(kind, count, gl.UNSIGNED_INT, 0);
    };
    part(this.indices.triangles, gl.TRIANGLES, this.triangles.length, [0, 0, 0, 0], 0);
    if (!this.edges || (moving && this.lines.length > FINE)) return;
    part(this.indices.lines, gl.LINES, this.lines.length, [0, 0, 0, this.lines.length > FINE ? 0.15 : 0.5], -0.002);
  }

  /** Returns the place of a point in the view, from -1 to 1, and its height toward the reader. */
  project(i) {
    const factor = this.factor * this.phase;
    const x = [0, 1, 2].map((k) => this.points[3 * i + k] + factor * this.u[3 * i + k] - this.center[k]);
    const [right, up, near] = this.turn.map((row) => row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
    const [sx, sy] = this.scales();
    return [right * sx + this.shift[0], up * sy + this.shift[1], near];
  }

  /** Returns the point nearest to the reader within eight pixels of a place of the canvas. */
  pick(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    let [found, nearest] = [-1, -Infinity];
    for (let i = 0; i < this.states.n; i++) {
      const [px, py, near] = this.project(i);
      const distance = Math.hypot(((px + 1) / 2) * width - x, ((1 - py) / 2) * height - y);
      if (distance < 8 && near > nearest) [found, nearest] = [i, near];
    }
    return found;
  }
}
