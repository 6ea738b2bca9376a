// Format numbers, sizes, durations and times, each with its unit.

import { MINUS, roundedToUncertainty, signed } from "./rounding.js";
import { shownUnit } from "./shown_unit.js";
import { superscript } from "./typeset.js";

/** @typedef {number | null | undefined} Numeric */

/**
 * Whether there is a finite number.
 * @param {unknown} value
 * @returns {value is number}
 */
export const isNumber = (value) => Number.isFinite(value);

/**
 * A number with `digits` significant digits, not in the form 1e-3: 0.00120, 1230, −40.0, 4.5 × 10⁻⁷.
 * @param {Numeric} value
 * @param {number} [digits]
 */
export function number(value, digits = 3) {
  if (!isNumber(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-5 || size >= 1e7)) return power(value, digits);
  const rounded = Number(value.toPrecision(digits));
  const decimals = size === 0 ? 0 : Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(rounded) || 1)));
  return fixed(rounded, Math.min(decimals, 8));
}

/**
 * @param {number} value
 * @param {number} digits
 */
function power(value, digits) {
  const [factor, exponent] = value.toExponential(digits - 1).split("e");
  return `${signed(factor)} × 10${superscript(exponent)}`;
}
/** Odds from so many decades on are written as a power of ten; those of more than the second number as a bound. */
const [POWER_DECADES, MOST_DECADES] = [6, 100];
/**
 * The odds for an effect as people say them; `nats` is the natural logarithm of the Bayes factor. Beyond 10¹⁰⁰ only the
 * bound is stated. `odds_text` of `labctl/probability_text.py` is the same.
 * @param {number} nats
 */
export function oddsText(nats) {
  const decades = Math.abs(nats) / Math.LN10;
  const odds =
    decades > MOST_DECADES
      ? `more than 10${superscript(MOST_DECADES)}`
      : decades >= POWER_DECADES
        ? `10${superscript(Math.round(decades))}`
        : String(Number((10 ** decades).toPrecision(2)));
  return nats >= 0 ? `${odds} to 1` : `1 to ${odds}`;
}

/**
 * A number without trailing zeros, for settings: −100, 12.5, 0.0042.
 * @param {Numeric} value
 * @param {number} [digits]
 */
export const plainNumber = (value, digits = 4) =>
  isNumber(value) ? String(Number(value.toPrecision(digits))).replaceAll("-", MINUS) : "–"; // also in 1e-7
/**
 * @param {Numeric} value
 * @param {string} unit
 * @param {number} [digits]
 */
export const withUnit = (value, unit, digits) => (isNumber(value) ? `${number(value, digits)} ${unit}` : "–");
/** @param {Numeric} value */
export const count = (value) => (isNumber(value) ? signed(value.toLocaleString("en-GB")) : "–");
/**
 * A share in whole percent. 0 % is nothing and 100 % is all: what is a little more or less is "< 1 %" or "> 99 %".
 * @param {Numeric} share
 */
export function percent(share) {
  if (!isNumber(share)) return "–";
  return 0 < share && share < 1 ? probabilityText(share) : `${signed(String(Math.round(100 * share)))} %`;
}

/** Probabilities beyond these are written as bounds: what was computed is neither impossible nor certain. */
const [LEAST, MOST] = [0.005, 0.995];
/**
 * A probability in whole percent: 25 %, < 1 %, > 99 %; never 0 % and never 100 %. `labctl/probability_text.py` is the same.
 * @param {number} probability
 */
export const probabilityText = (probability) =>
  probability < LEAST ? "< 1 %" : probability < MOST ? `${Math.floor(100 * probability + 0.5)} %` : "> 99 %";

/**
 * A number with so many decimals; one that is rounded to zero has no sign: 0.0000.
 * @param {number} value
 * @param {number} decimals
 */
export const fixed = (value, decimals) => signed(value.toFixed(decimals));

/**
 * A mean to one place beyond its spread, so that a column of means lines up; to five digits where there is no spread.
 * @param {Numeric} value
 * @param {Numeric} spread
 */
export function mean(value, spread) {
  if (!isNumber(value) || !isNumber(spread) || spread <= 0) return number(value, 5);
  return fixed(value, Math.min(Math.max(2 - Math.floor(Math.log10(spread)), 0), 8));
}

/**
 * How far readings scatter: their standard deviation s, never with the sign ±, which is that of U with k = 2.
 * @param {Numeric} std
 */
export const scatterText = (std) => `s = ${number(std, 2)}`;

/**
 * Seconds as 45 h 10 min, 3 min 20 s, 12 s.
 * @param {Numeric} seconds
 */
export function duration(seconds) {
  if (!isNumber(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  const rounded = Math.round(whole / 60);
  if (rounded >= 60) return `${Math.floor(rounded / 60)} h ${rounded % 60} min`;
  const minutes = Math.floor(whole / 60);
  return minutes ? `${minutes} min ${whole % 60} s` : `${whole} s`;
}

/** @type {Intl.DateTimeFormatOptions} */
const DAY = { weekday: "short", day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" };
/**
 * An instant in the time zone of the browser; with the year where it is not the present one.
 * @param {string | null | undefined} text
 */
export function instant(text) {
  if (!text) return "–";
  const at = new Date(text);
  const isThisYear = at.getFullYear() === new Date().getFullYear();
  return at.toLocaleString("en-GB", isThisYear ? DAY : { ...DAY, year: "numeric" });
}
/**
 * The same always with the year, for what is read again in later years: 30 Nov 2026, 02:38.
 * @param {string | null | undefined} text
 */
export const dated = (text) =>
  text ? `${day(text)}, ${new Date(text).toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" })}` : "–";
/** @param {string | null | undefined} text */
export const day = (text) =>
  text ? new Date(text).toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" }) : "–";
/** @param {string | null | undefined} text */
export const clock = (text) => (text ? new Date(text).toLocaleTimeString("en-GB") : "–");

/**
 * An id as text: scale_factor_asymmetry -> scale factor asymmetry.
 * @param {string} id
 */
export const idText = (id) => String(id).replaceAll("_", " ");

/**
 * A sentence of the service with effects as the links beside it name them: "scale factor odd", not "scale_factor_odd".
 * A command between backticks keeps the ids, which it needs. A title in brackets that begins with the same
 * words again is left out as far as it does.
 * @param {string} text
 * @param {Iterable<string>} ids of effects
 */
export function inWords(text, ids) {
  const all = [...new Set(ids)];
  if (!all.length) return text;
  const whole = new RegExp(`(?<![\\w-])(${all.join("|")})(?![\\w-])( \\(((?:[^()]|\\([^()]*\\))*)\\))?`, "g");
  /** @type {(match: string, id: string, brackets?: string, title?: string) => string} */
  const named = (_, id, brackets = "", title = "") =>
    title.toLowerCase().startsWith(idText(id)) ? idText(id) + title.slice(id.length) : idText(id) + brackets;
  return text
    .split("`")
    .map((part, k) => (k % 2 ? part : part.replaceAll(whole, named)))
    .join("`");
}

/** Most characters of a name of a person that a page shows; a request takes no longer one. */
export const MAX_PERSON_CHARACTERS = 120;

/**
 * The name of a person; one that an older version of labctl stored may be longer than a line, and is cut.
 * @param {string} name
 */
export const personText = (name) =>
  name.length > MAX_PERSON_CHARACTERS ? `${name.slice(0, MAX_PERSON_CHARACTERS)}…` : name;

/** @param {string} text */
export const capitalised = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/**
 * A size with its unit: 14 ppm, 2.7 %, 0.31 mrad, 0.0042 deg/s.
 * @param {Numeric} value
 * @param {string | null | undefined} unit
 * @param {string} name of the coefficient or effect
 */
export function sizeText(value, unit, name) {
  if (!isNumber(value)) return "–";
  const [factor, shown] = shownUnit(unit, name);
  const text = value === 0 ? "0" : factor === 1 ? number(value, 2) : plainNumber(factor * value, 2);
  return `${text} ${shown}`;
}

/**
 * A result and its expanded uncertainty as texts of the same place, with their common suffix: power of ten and unit.
 * @param {number} value
 * @param {number | null} expanded
 * @param {string} unit
 * @param {string} [name] of the coefficient or effect, where it is one
 */
export function resultTexts(value, expanded, unit, name = "") {
  const [factor, own] = shownUnit(unit, name);
  const {
    value: middle,
    u: half,
    exponent,
  } = roundedToUncertainty(value * factor, expanded === null ? null : expanded * factor);
  return { middle, half, power: exponent ? `× 10${superscript(exponent)}` : "", suffix: own };
}

/**
 * A result with its expanded uncertainty, to the same place: 201.3 ± 3.1 ppm, (9.06 ± 0.02) × 10⁻⁷ (deg/s)⁻¹.
 * @param {Numeric} value
 * @param {number | null} expanded
 * @param {string} unit
 * @param {string} [name] of the coefficient or effect, where it is one
 */
export function withUncertainty(value, expanded, unit, name) {
  if (!isNumber(value)) return "–";
  const known = expanded !== null && expanded > 0 ? expanded : null;
  const { middle, half, power, suffix } = resultTexts(value, known, unit, name);
  const text = half === null ? middle : `${middle} ± ${half}`;
  return [power ? (half === null ? `${text} ${power}` : `(${text}) ${power}`) : text, suffix].filter(Boolean).join(" ");
}
