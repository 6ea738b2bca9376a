// Coefficients of a version that are columns over temperature.

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

/** @param {Pick<Version, "axes">} version */
export const coefficientColumns = (version) =>
  Object.entries(version.axes).flatMap(([axis, values]) => columnsOf(axis, values));
