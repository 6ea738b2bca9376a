// Texts as a page writes them: the service and the commands write signs of mathematics in ASCII.

import { splitAtNames } from "./names.js";
import { MINUS } from "./rounding.js";

/** A space at which no line ends. */
const NO_BREAK = "\u00a0";
/** @type {Record<string, string>} */
const SUPERSCRIPTS = {
  "-": "⁻",
  "(": "⁽",
  ")": "⁾",
  i: "ⁱ",
  k: "ᵏ",
  ...Object.fromEntries([..."⁰¹²³⁴⁵⁶⁷⁸⁹"].map((raised, digit) => [digit, raised])),
};
/** @param {string | number} text */
export const superscript = (text) => [...String(text)].map((sign) => SUPERSCRIPTS[sign] ?? "").join("");

/** A number as programs write it: 5e-05. A part of a name or of a hash is none. */
const POWER = /(?<![\w.-])(-?\d+(?:\.\d+)?)e([+-]?)0*(\d+)(?![\w.]*\w)/g;
/** A power as programs write it: (deg/s)^-1, e^254. */
const RAISED = /\^(-?\d+)/g;
/** What stays together in a line: "< 1 %", "0.0012 ± 0.0003". */
const UNBROKEN = /(?<=\d) %|(?<=(^|[\s(])[<>]) (?=\d)|(?<=×) (?=10)|(?<=\d) (?=×)| ± /g;
/**
 * A plus or minus before a number, and the sign of a negative number or of the negative end of an axis (-y); not the
 * hyphen of a word, a range or a date.
 */
const [PLUS_MINUS, NEGATIVE] = [/\+-(?=\s*\d)/g, /(?<![\w-])-(?=\d|[xyz]\b)/g];

/** Degrees Celsius as the service and the commands write them, and as a page does. */
const [ASCII_CELSIUS, CELSIUS] = ["deg C", "°C"];
/**
 * A text of a page as a file has it, for programs.
 * @param {string} text
 */
export const withoutCelsius = (text) => text.replaceAll(CELSIUS, ASCII_CELSIUS);

/**
 * A text with the minus sign, ±, powers and °C: "+-90 deg/s, -5e-05 K^-1" is "±90 deg/s, −5 × 10⁻⁵ K⁻¹". Names that
 * people have given stay as they are.
 * @param {string} text
 */
export function typeset(text) {
  if (!/-|e\+|\^|[%<>×±]|deg C/.test(text)) return text;
  return splitAtNames(text)
    .map((part, k) => (k % 2 ? part : withSigns(part)))
    .join("");
}

/** @param {string} text */
function withSigns(text) {
  return text
    .replaceAll(ASCII_CELSIUS, CELSIUS)
    .replace(POWER, (_, factor, sign, power) => `${factor} × 10${superscript(sign + power)}`)
    .replace(RAISED, (_, power) => superscript(power))
    .replace(PLUS_MINUS, "±")
    .replace(NEGATIVE, MINUS)
    .replace(UNBROKEN, (gap) => gap.replace(/^ /, NO_BREAK));
}
