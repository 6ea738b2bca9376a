// Colour scales of figures: one for temperatures, one for rates, one for residuals. A test holds the first equal to that
// of the report (labctl/plots/temperature_scale.py).

/** @typedef {readonly (readonly [share: number, colour: string])[]} Scale */

/**
 * Temperature, by its share of the range shown: blue is cold, red is hot.
 * @type {Scale}
 */
export const TEMPERATURE_SCALE = [
  [0, "#2f60be"],
  [0.25, "#59aab8"],
  [0.5, "#c3af65"],
  [0.75, "#cb7034"],
  [1, "#bd1018"],
];
/**
 * Rate: violet is negative, grey is rest, green is positive. Neither is cold or hot.
 * @type {Scale}
 */
export const RATE_SCALE = [
  [0, "#9b5fc0"],
  [0.5, "#8f979f"],
  [1, "#2f9e5b"],
];
/**
 * Residual over floor, the same in every map: blue below, red above.
 * @type {Scale}
 */
export const DIVERGING = [
  [0, "#1f5fa8"],
  [0.35, "#8db3d9"],
  [0.5, "#c9ccd0"],
  [0.65, "#dd9a8b"],
  [1, "#b3242f"],
];

/**
 * A colour of the theme, `#rrggbb`, that lets through what is below it; Plotly knows no color-mix.
 * @param {string} hex
 * @param {number} share how much of it stays
 */
export const faded = (hex, share) => `rgba(${channels(hex).join(",")},${share})`;

/** @param {string} hex */
const channels = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/**
 * The colour at a share of a scale, as `rgb(r,g,b)`.
 * @param {Scale} scale
 * @param {number} share
 */
export function colourAt(scale, share) {
  const at = Math.min(Math.max(share, 0), 1);
  const k = Math.max(
    scale.findIndex(([stop]) => at <= stop),
    1,
  );
  const [[from, low], [to, high]] = [scale[k - 1], scale[k]];
  const [a, b] = [channels(low), channels(high)];
  return `rgb(${a.map((value, c) => Math.round(value + ((at - from) / (to - from)) * (b[c] - value))).join(",")})`;
}

/** @param {readonly number[]} values */
const span = (values) =>
  values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
/**
 * @param {string} title
 * @param {object} [more]
 */
const bar = (title, more) => ({ title: { text: title }, thickness: 12, outlinewidth: 0, ...more });

/**
 * Colours for temperatures: {of(temperature), axis}, `axis` being Plotly's coloraxis.
 * @param {readonly number[]} temperatures
 * @param {object} [barMore]
 */
export function temperatureColours(temperatures, barMore) {
  const [low, high] = span(temperatures);
  /** @param {number} value */
  const of = (value) => colourAt(TEMPERATURE_SCALE, high > low ? (value - low) / (high - low) : 0.5);
  return { of, axis: { colorscale: TEMPERATURE_SCALE, cmin: low, cmax: high, colorbar: bar("°C", barMore) } };
}

/**
 * The same for rates; zero is in the middle.
 * @param {readonly number[]} rates
 * @param {object} [barMore]
 */
export function rateColours(rates, barMore) {
  const most = Math.max(...span(rates).map(Math.abs)) || 1;
  return {
    /** @param {number} value */
    of: (value) => colourAt(RATE_SCALE, 0.5 + value / most / 2),
    axis: { colorscale: RATE_SCALE, cmin: -most, cmax: most, colorbar: bar("deg/s", barMore) },
  };
}
