// Spectrum and damping of a recorded curve.

/** Resamples a curve linearly at `n` equally spaced times. */
function resample(t, y, n) {
  const [start, step] = [t[0], (t[t.length - 1] - t[0]) / (n - 1)];
  const found = new Float64Array(n);
  for (let i = 0, k = 0; i < n; i++) {
    const at = start + i * step;
    while (k < t.length - 2 && t[k + 1] < at) k++;
    const width = t[k + 1] - t[k];
    const part = width > 0 ? Math.min(1, (at - t[k]) / width) : 0;
    found[i] = y[k] + part * (y[k + 1] - y[k]);
  }
  return found;
}

/** Computes the Fourier transform of a power of two of complex numbers in place (radix 2). */
function fourier(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) [re[i], re[j], im[i], im[j]] = [re[j], re[i], im[j], im[i]];
  }
  for (let size = 2; size <= n; size *= 2) {
    const half = size / 2;
    for (let k = 0; k < half; k++) {
      const [c, s] = [Math.cos((-2 * Math.PI * k) / size), Math.sin((-2 * Math.PI * k) / size)];
      for (let a = k; a < n; a += size) {
        const b = a + half;
        const [x, y] = [re[b] * c - im[b] * s, re[b] * s + im[b] * c];
        [re[b], im[b]] = [re[a] - x, im[a] - y];
        [re[a], im[a]] = [re[a] + x, im[a] + y];
      }
    }
  }
}

const powerOfTwo = (n) => 2 ** Math.ceil(Math.log2(n));
const meanOf = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

/** Returns the magnitudes of the Fourier transform of `values` padded with zeros to `n`, up to the Nyquist frequency. */
function magnitudes(values, n) {
  const [re, im] = [new Float64Array(n), new Float64Array(n)];
  re.set(values);
  fourier(re, im);
  return re.subarray(0, n / 2).map((x, i) => Math.hypot(x, im[i]));
}

/** Returns the amplitude spectrum without the mean, by a Hann window. A sine that fits the window has its amplitude. */
function spectrumOf(t, y) {
  const n = Math.min(32768, powerOfTwo(t.length));
  const even = resample(t, y, n);
  const mean = meanOf(even);
  const weighted = even.map((value, i) => (value - mean) * (1 - Math.cos((2 * Math.PI * i) / n)));
  const step = (t[t.length - 1] - t[0]) / (n - 1);
  const amplitude = magnitudes(weighted, n).map((size) => (2 * size) / n);
  return { frequency: amplitude.map((_, i) => i / (n * step)), amplitude };
}

/** Returns alternating extremes that differ by more than `least`, each as its time and value. */
function extremesOf(t, y, least) {
  const found = [];
  let [direction, last, high, low] = [0, 0, 0, 0];
  for (let i = 1; i < y.length; i++) {
    if (direction === 0) {
      if (y[i] > y[high]) high = i;
      if (y[i] < y[low]) low = i;
      if (y[i] - y[low] > least) [direction, last, high] = [1, i, low];
      else if (y[high] - y[i] > least) [direction, last] = [-1, i];
      // The first value is not an extreme.
      if (direction !== 0 && high > 0) found.push(high);
    } else if (direction * (y[i] - y[last]) > 0) {
      last = i;
    } else if (direction * (y[last] - y[i]) > least) {
      found.push(last);
      [direction, last] = [-direction, i];
    }
  }
  return found.map((i) => vertexOf(t, y, i));
}

/** Returns the vertex of the parabola through a point and its neighbors. */
function vertexOf(t, y, i) {
  if (i === 0 || i === y.length - 1) return [t[i], y[i]];
  const [a, b] = [t[i - 1] - t[i], t[i + 1] - t[i]];
  const [p, q] = [(y[i - 1] - y[i]) / a, (y[i + 1] - y[i]) / b];
  const curvature = (q - p) / (b - a);
  if (curvature === 0) return [t[i], y[i]];
  const slope = p - curvature * a;
  const shift = Math.min(b, Math.max(a, -slope / (2 * curvature)));
  return [t[i] + shift, y[i] + slope * shift + curvature * shift * shift];
}

/**
 * Returns frequency and damping of a decaying oscillation by the logarithmic decrement: a line through the logarithms
 * of the differences of successive extremes, in which the position of rest cancels. Returns null for fewer than four.
 */
function decrementOf(t, y) {
  const range = y.reduce((most, value) => Math.max(most, value), -Infinity) - y.reduce((least, value) => Math.min(least, value), Infinity);
  const extremes = extremesOf(t, y, 0.02 * range);
  if (extremes.length < 4) return null;
  const swings = extremes.slice(1).map(([time, value], i) => [(time + extremes[i][0]) / 2, Math.log(Math.abs(value - extremes[i][1]))]);
  const n = swings.length;
  const [x0, y0] = [meanOf(swings.map(([x]) => x)), meanOf(swings.map(([, v]) => v))];
  const xx = swings.reduce((sum, [x]) => sum + (x - x0) ** 2, 0);
  const slope = swings.reduce((sum, [x, v]) => sum + (x - x0) * (v - y0), 0) / xx;
  const rest = swings.reduce((sum, [x, v]) => sum + (v - y0 - slope * (x - x0)) ** 2, 0);
  const frequency = (extremes.length - 1) / 2 / (extremes.at(-1)[0] - extremes[0][0]);
  const decrement = -slope / frequency;
  return {
    frequency,
    decrement,
    error: n > 2 ? Math.sqrt(rest / (n - 2) / xx) / frequency : NaN,
    ratio: decrement / Math.hypot(2 * Math.PI, decrement),
    cycles: n / 2,
  };
}

/**
 * Returns the frequency of the highest peak of a free decay and the damping ratio by its width at half power. `resolved`
 * is false if the width is near that of a constant oscillation in the same window. Returns null without a peak.
 */
function halfPowerOf(t, y) {
  const n = Math.min(16384, powerOfTwo(t.length));
  const duration = t[t.length - 1] - t[0];
  const even = resample(t, y, n);
  const mean = meanOf(even);
  const padded = 16 * n;
  const size = magnitudes(even.map((value) => value - mean), padded);
  const step = (n - 1) / (duration * padded);
  let peak = Math.ceil(1.5 / duration / step);
  for (let i = peak; i < size.length; i++) if (size[i] > size[peak]) peak = i;
  const level = size[peak] / Math.SQRT2;
  const crossing = (direction) => {
    let i = peak;
    while (i > 0 && i < size.length - 1 && size[i] > level) i += direction;
    if (size[i] > level) return NaN;
    return i - direction * ((level - size[i]) / (size[i - direction] - size[i]));
  };
  const width = (crossing(1) - crossing(-1)) * step;
  const frequency = peak * step;
  if (!(width > 0)) return null;
  return { frequency, width, ratio: width / (2 * frequency), resolved: width > 2 * (0.886 / duration) };
}
