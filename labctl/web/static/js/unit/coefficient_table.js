// Coefficients of a version that are columns over temperature.

import { idText, number, plainNumber, withUncertainty } from "../core/format.js";

/** @import { Coefficient, CoefficientAxis, CoefficientTable, Version } from "../../../types/api.js" */
/**
 * @typedef {object} CoefficientColumn a coefficient of an axis over temperature
 * @property {string} axis
 * @property {string} name
 * @property {number[]} temperature_c
 * @property {number[]} value
 * @property {(number | null)[]} u
 * @property {string} unit
 */

/**
 * The columns of an axis; none where its coefficients have one value each.
 * @param {string} axis
 * @param {CoefficientAxis} values
 * @returns {CoefficientColumn[]}
 */
function columnsOf(axis, values) {
  const { temperature_c } = values.coefficients;
  if (!Array.isArray(temperature_c)) return [];
  return Object.entries(values.coefficients).flatMap(([name, found]) =>
    isTable(found) ? [{ axis, name, temperature_c, value: found.value, u: found.u, unit: found.unit }] : [],
  );
}

/** @typedef {Coefficient | CoefficientTable | number[]} Found */

/**
 * @param {Found} found
 * @returns {found is CoefficientTable}
 */
const isTable = (found) => !Array.isArray(found) && Array.isArray(found.value);
/**
 * @param {Found | undefined} found
 * @returns {found is Coefficient}
 */
export const isSingle = (found) => found !== undefined && !Array.isArray(found) && !Array.isArray(found.value);

/**
 * The coefficients of a version beside the columns of another one: its own columns, and each single value as one that is
 * the same at all temperatures of the other's column.
 * @param {Pick<Version, "axes">} version
 * @param {readonly CoefficientColumn[]} others
 * @returns {CoefficientColumn[]}
 */
export function columnsBeside(version, others) {
  const own = coefficientColumns(version);
  const constant = others.flatMap(({ axis, name, temperature_c }) => {
    const found = version.axes[axis]?.coefficients[name];
    if (!isSingle(found)) return [];
    const { value, u, unit } = found;
    return [{ axis, name, temperature_c, value: temperature_c.map(() => value), u: temperature_c.map(() => u), unit }];
  });
  return [...own, ...constant];
}

/**
 * What two versions have in common and not, in words.
 * @param {{ version: number, effects: readonly string[], columns: boolean }} first
 * @param {{ version: number, effects: readonly string[], columns: boolean }} second
 */
export function differenceText(first, second) {
  const more = first.effects.filter((id) => !second.effects.includes(id)).map(idText);
  const less = second.effects.filter((id) => !first.effects.includes(id)).map(idText);
  const parts = [more.length ? `has ${more.join(", ")} more` : "", less.length ? `lacks ${less.join(", ")}` : ""];
  const effects = parts.some(Boolean)
    ? `Version ${first.version} ${parts.filter(Boolean).join(" and ")} than version ${second.version}.`
    : `Versions ${first.version} and ${second.version} have the same effects.`;
  if (first.columns === second.columns) return effects;
  const [table, single] = first.columns ? [first, second] : [second, first];
  return `${effects} The coefficients of version ${table.version} change with temperature, those of version ${single.version} are one value each.`;
}

/**
 * Recordings that two versions were both fitted to.
 * @param {Pick<Version, "recordings">} first
 * @param {Pick<Version, "recordings">} second
 */
export const sharedRecordings = (first, second) => first.recordings.filter((each) => second.recordings.includes(each));

/**
 * Why the differences of coefficients are not given in u, and what else they may come from; empty for fits of other data.
 * @param {Pick<Version, "recordings" | "model">} first
 * @param {Pick<Version, "recordings" | "model">} second
 */
export function correlatedText(first, second) {
  const shared = sharedRecordings(first, second);
  if (!shared.length) return "";
  const [one, other] = [first, second].map(({ model }) => [...model.effects].sort().join());
  const redefined =
    one === other
      ? ""
      : " Where the effects differ, a coefficient of the same name may be another quantity: beside a nonlinearity, the scale factor is the slope at rate 0, and without it the slope of a straight line.";
  return `Both are fits of recording ${shared.join(", ")}: their errors are correlated, so a difference cannot be compared with u.${redefined}`;
}

/**
 * The difference of two coefficients: in standard uncertainties where they come from different data.
 * @param {Coefficient} own
 * @param {Coefficient | null} beside
 * @param {{ name: string, shared: boolean }} of
 */
export function differenceOf(own, beside, { name, shared }) {
  if (!beside) return "–";
  if (shared) return withUncertainty(own.value - beside.value, null, own.unit, name);
  if (own.u === null || beside.u === null) return "–";
  return `${number(Math.abs(own.value - beside.value) / Math.hypot(own.u, beside.u), 2)} u`;
}

/** @param {Pick<Version, "axes">} version */
export const coefficientColumns = (version) =>
  Object.entries(version.axes).flatMap(([axis, values]) => columnsOf(axis, values));

/** @type {Readonly<Record<string, string>>} units of the parameters of effects by the end of their name */
const PARAMETER_UNITS = { dps: "deg/s", s: "s", hz: "Hz", c: "°C" };

/**
 * What the coefficients of a version are relative to, and the parameters of its effects that no coefficient states.
 * @param {Pick<Version, "axes" | "model" | "reference_temperature_c">} version
 */
export function termsText({ axes, model, reference_temperature_c }) {
  const names = Object.values(axes).flatMap(({ coefficients }) => Object.keys(coefficients));
  const reference = names.some((name) => /_t\d$/.test(name))
    ? [`T_ref is ${plainNumber(reference_temperature_c)} °C`]
    : [];
  /** @param {string} name */
  const isCoefficient = (name) => names.includes(name) || names.includes(name.replace(/_[xyz]$/, ""));
  const parameters = (model.terms ?? []).flatMap(({ effect, parameters: own }) =>
    Object.entries(own)
      .filter(([name]) => !isCoefficient(name)) // where its law is fitted, a shape is only where it was tried
      .map(([name, value]) => {
        const [, words = name, end = ""] = /^(.*)_([a-z]+)$/.exec(name) ?? [];
        const unit = PARAMETER_UNITS[end];
        return `${idText(effect)}: ${idText(unit ? words : name)} ${plainNumber(value)}${unit ? ` ${unit}` : ""}`;
      }),
  );
  const said = [...reference, ...parameters].join("; ");
  return said && `${said}.`;
}

/**
 * The nominal scale factor of each output, to which the coefficients of the scale factor are relative; empty where an old
 * answer states none.
 * @param {Pick<Version, "output">} version
 */
export function nominalText({ output }) {
  const lines = Object.entries(output).map(([axis, { unit, scale, offset }]) => {
    const at = `${plainNumber(scale, 6)} ${unit} per deg/s`;
    return `axis ${axis}: ${at}, ${plainNumber(offset, 6)} ${unit} at rest`;
  });
  return lines.length
    ? `Nominal scale factor, to which the coefficients of the scale factor are relative: ${lines.join("; ")}.`
    : "";
}
