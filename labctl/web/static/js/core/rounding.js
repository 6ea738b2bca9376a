// A result rounded to its uncertainty (GUM 7.2.6): the uncertainty to two significant digits, the value to the same place.

const MAX_DECIMALS = 12;
/** Results from 10^6 on and below 10^-4 are written with a power of ten. */
const [MIN_POWER, MAX_POWER] = [-4, 5];

/** The sign of a negative number on a page, as the axes of the figures have it: U+2212, not a hyphen. */
export const MINUS = "\u2212";

/**
 * The text of a number as a page shows it: with the minus sign, and a zero without a sign: -1.5 -> −1.5, -0.0 -> 0.0.
 * @param {string} text
 */
export const signed = (text) => text.replace(/^-(?=[0.]*$)/, "").replace(/^-/, MINUS);

/**
 * Round a value to its uncertainty: {value, u, exponent}, texts that both count in units of 10^exponent.
 * `u` is null where there is no uncertainty; the value then has four significant digits.
 * @param {number} value
 * @param {number | null} uncertainty
 */
export function roundedToUncertainty(value, uncertainty) {
  const known = uncertainty !== null && uncertainty > 0 && Number.isFinite(uncertainty);
  const u = known ? Number(uncertainty.toExponential(1)) : null; // two significant digits, so 0.0999 is 0.10
  const largest = Math.max(Math.abs(value), u ?? 0);
  const size = largest > 0 ? Math.floor(Math.log10(largest)) : 0;
  const exponent = size < MIN_POWER || size > MAX_POWER ? size : 0;
  if (u === null) return { value: signed(String(Number((value / 10 ** exponent).toPrecision(4)))), u: null, exponent };
  const place = Number(u.toExponential(1).split("e")[1]) - exponent - 1; // of the second significant digit
  const decimals = Math.min(Math.max(-place, 0), MAX_DECIMALS);
  const unit = 10 ** Math.max(place, 0);
  /** @param {number} number */
  const text = (number) => (Math.round(number / 10 ** exponent / unit) * unit).toFixed(0);
  /** @param {number} number */
  const fixed = (number) => signed(place > 0 ? text(number) : (number / 10 ** exponent).toFixed(decimals));
  return { value: fixed(value), u: fixed(u), exponent };
}
