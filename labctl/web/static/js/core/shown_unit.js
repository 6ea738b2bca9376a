// The units in which quantities are shown: one rule for all pages. `labctl/shown_unit.py` is the same.

import { superscript } from "./typeset.js";

/** Plain numbers that are small angles: how their names begin. */
const ANGLES = /^(?:[xyz][. ])?(?:misalignment|non_orthogonality)(?![a-z])/;
/** Plain numbers that are parts of a whole other than the rate: of a band, a step, a law, or of the steps of a table. */
const PARTS =
  /^(?:[xyz][. ])?(?:dead_band|missed_steps|quantization|saturation|sine_response|start_from_rate|start_of_rate|start_transient)(?![a-z])/;
/** Plain numbers near 1, or elements of a matrix with ones on its diagonal: they stay as they are. */
const RATIOS = /^(?:[xyz][. ])?soft iron(?![a-z])/;

/** A power as the catalogue writes it: ^-1, ^k, ^-(k-1). */
const POWER = /\^(-?(?:\d+|[ik]|\([\dik-]+\)))/g;
/** A plain number, and one for each of something: 1, 1/K, 1 K^-2. */
const PLAIN = /^1(?![^ /])/;

/** @typedef {readonly [factor: number, unit: string]} ShownUnit a shown number is the stored one times the factor */

/**
 * A unit as text: (deg/s)^-1 -> (deg/s)⁻¹, K^-k -> K⁻ᵏ. A plain number has none.
 * @param {string | null | undefined} unit
 */
export const unitText = (unit) => (unit === "1" ? "" : (unit ?? "").replace(POWER, (_, power) => superscript(power)));

/**
 * The unit in which a quantity is shown, whatever its value. Of plain numbers angles are in mrad, parts of a whole in %,
 * ratios as they are, and all others, which are relative to the rate, in ppm, and their changes with temperature in
 * ppm/K; an angle in rad is in mrad.
 * @param {string | null | undefined} unit
 * @param {string} name of the coefficient or effect
 * @returns {ShownUnit}
 */
export function shownUnit(unit, name) {
  if (unit === "rad") return [1e3, "mrad"];
  if (!unit || !PLAIN.test(unit)) return [1, unitText(unit)];
  const [factor, shown] = plainUnit(name);
  return [factor, unit === "1" ? shown : `${shown || "1"}${unitText(unit.slice(1))}`];
}

/**
 * @param {string} name
 * @returns {ShownUnit}
 */
function plainUnit(name) {
  if (RATIOS.test(name)) return [1, ""];
  if (ANGLES.test(name)) return [1e3, "mrad"];
  return PARTS.test(name) ? [100, "%"] : [1e6, "ppm"];
}
