// What an effect of another size would leave. For a linear effect this is exact: with its size held at a share of the
// fitted one and all other coefficients fitted again, each residual moves in a straight line from the fit without the
// effect (share 0) to the fit with it (share 1).

/** @import { Coefficient } from "../../../types/api.js" */
/** @typedef {readonly (number | null)[]} Values */

/**
 * The residual with a share of the effect.
 * @param {Values} before deg/s, of the fit without it
 * @param {Values} explained deg/s, what the fit with it takes off
 * @param {number} share of its fitted size
 * @returns {(number | null)[]}
 */
export const leftWith = (before, explained, share) =>
  before.map((value, k) => {
    const part = explained[k];
    return value === null || part === null ? null : value - share * part;
  });

/**
 * Root of the mean square over the data sets that have a value.
 * @param {Values} values
 */
export function rmsOf(values) {
  const known = values.filter((value) => value !== null);
  return Math.sqrt(known.reduce((sum, value) => sum + value * value, 0) / Math.max(known.length, 1));
}

/**
 * The coefficients of an effect that a fit estimates, without those that follow from them: k from its square.
 * @param {Readonly<Record<string, Coefficient>>} coefficients
 */
export const freeCoefficients = (coefficients) =>
  Object.entries(coefficients).filter(([, { identified }]) => identified === undefined);

/**
 * Half the band of the size, k = 2, as a share of it; null for an effect of several coefficients, whose sizes go together.
 * @param {Readonly<Record<string, Coefficient>>} coefficients
 */
export function bandOf(coefficients) {
  const free = freeCoefficients(coefficients);
  const [[, only] = [null, null]] = free;
  return free.length === 1 && only && only.u !== null && only.value ? Math.abs((2 * only.u) / only.value) : null;
}

/**
 * Means over the data sets of each level of a channel, in rising order.
 * @param {Values} x
 * @param {Values} values
 * @param {(value: number) => number} levelOf the level that a value belongs to
 */
export function levelMeans(x, values, levelOf) {
  /** @type {Map<number, { x: number, sum: number, n: number }>} */
  const levels = new Map();
  x.forEach((at, k) => {
    const value = values[k];
    if (at === null || value === null || value === undefined) return;
    const key = levelOf(at);
    const level = levels.get(key) ?? { x: 0, sum: 0, n: 0 };
    levels.set(key, { x: level.x + at, sum: level.sum + value, n: level.n + 1 });
  });
  return [...levels.entries()]
    .sort(([a], [b]) => a - b)
    .map(([, { x: at, sum, n }]) => ({ x: at / n, mean: sum / n, n }));
}

/**
 * Where two effects part: the levels at which their means differ by more than `factor` times the noise of that mean.
 * @param {readonly { x: number, mean: number, n: number }[]} one
 * @param {readonly { x: number, mean: number, n: number }[]} other at the same levels
 * @param {number} floor noise floor of one data set, deg/s
 * @param {number} [factor]
 */
export const partingLevels = (one, other, floor, factor = 3) =>
  one
    .filter((level, k) => Math.abs(level.mean - other[k].mean) > (factor * floor) / Math.sqrt(level.n))
    .map((level) => level.x);

/**
 * A recipe that measures at the rates where two effects part, evenly chosen where there are many.
 * @param {object} plan
 * @param {string} plan.name
 * @param {readonly number[]} plan.rates_dps
 * @param {readonly number[]} plan.temperatures_c
 * @param {readonly string[]} plan.positions
 * @param {number} [most] rates
 */
export function partingRecipe({ name, rates_dps, temperatures_c, positions }, most = 12) {
  const step = Math.max(1, Math.ceil(rates_dps.length / most));
  const rates = rates_dps.filter((_, k) => k % step === 0 || k === rates_dps.length - 1);
  const list = (/** @type {readonly number[]} */ values) =>
    values.map((value) => Number(value.toPrecision(4))).join(", ");
  return `format = "labctl-recipe/1"
name = "${name.replaceAll(/[^a-z0-9-]+/gi, "-").slice(0, 40)}"
temperatures_c = [${list(temperatures_c)}]
rates_dps = [${list(rates)}]
positions = [${positions.map((each) => `"${each}"`).join(", ")}]

[soak]
hold_s = 3600
max_drift_c = 0.5
drift_window_s = 600
timeout_s = 14400

[acquire]
duration_s = 60
settle_s = 5
`;
}

/** @typedef {{ low: number, high: number }} Range of a parameter of a shape */

/**
 * Where a value is on a slider, 0 to 1: by ratios where the range has only positive values.
 * @param {Range} range
 * @param {number} value
 */
export function sliderAt({ low, high }, value) {
  const share = low > 0 ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(1, Math.max(0, share));
}

/**
 * The value at a place of a slider, to four digits and never outside the range.
 * @param {Range} range
 * @param {number} share 0 to 1
 */
export function valueAt({ low, high }, share) {
  const value = low > 0 ? low * (high / low) ** share : low + share * (high - low);
  return Math.min(high, Math.max(low, Number(value.toPrecision(4))));
}

/**
 * An effect in a stated shape, as requests write it.
 * @param {string} effect
 * @param {Record<string, number>} parameters
 */
export const termOf = (effect, parameters) =>
  [effect, ...Object.entries(parameters).map(([name, value]) => `${name}=${value}`)].join("@");
