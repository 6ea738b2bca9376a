// Coefficients of a version that were held at known values.

/** @import { Version } from "../../../types/api.js" */

/**
 * Which coefficients were held, and where their values are from; null: none was.
 * @param {Version} version
 */
export function heldText(version) {
  const { held } = version.model;
  if (held === null) return null;
  const names = Object.entries(held.axes).map(([axis, own]) => `axis ${axis}: ${Object.keys(own).join(", ")}`);
  return `Version ${version.version} held these coefficients at known values and did not fit them (source: ${held.source}): ${names.join("; ")}.`;
}
