// Coefficients of a version that are columns over temperature.

/** @import { CoefficientAxis, Version } from "../../../types/api.js" */
/**
 * @typedef {object} CoefficientColumn a coefficient of an axis over temperature
 * @property {string} axis
 * @property {string} name
 * @property {number[]} temperature_c
 * @property {(number | null)[]} value
 * @property {number[] | null} [u]
 * @property {string} unit
 */

/**
 * The columns of an axis, which are its own or those of its `coefficients`; none where it has one value each.
 * @param {string} axis
 * @param {CoefficientAxis} values
 * @returns {CoefficientColumn[]}
 */
function columnsOf(axis, values) {
  const own = values.coefficients?.temperature_c ? values.coefficients : values;
  const { temperature_c } = own;
  if (!temperature_c) return [];
  return Object.entries(own).flatMap(([name, found]) =>
    isColumn(found) ? [{ axis, name, temperature_c, ...found }] : [],
  );
}

/**
 * @param {unknown} found
 * @returns {found is { value: (number | null)[], u?: number[] | null, unit: string }}
 */
const isColumn = (found) =>
  typeof found === "object" && found !== null && "value" in found && Array.isArray(found.value);

/** @param {Pick<Version, "axes">} version */
export const coefficientColumns = (version) =>
  Object.entries(version.axes).flatMap(([axis, values]) => columnsOf(axis, values));
