// What a version says beside its coefficients: hold-out by leg, what is not exported, what is remembered in use.

import { h } from "../core/elements.js";
import { idText, number } from "../core/format.js";
import { notice, table } from "../core/components.js";
import { jointParts } from "../joint/card.js";
import { priorText } from "./type_prior.js";

/** @import { Version } from "../../../types/api.js" */

/** @param {Version} version */
export function versionFacts(version) {
  return [
    version.notices?.length ? notice("bad", standardsFoundBad(version)) : null,
    version.rate_reference ? h("p", {}, `Rates of its recordings: ${version.rate_reference}.`) : null,
    "type_prior" in version && version.type_prior ? h("p", {}, priorText(version.type_prior)) : null,
    heldOutByLeg(version),
    leftOut(version),
    remembered(version),
    version.joint
      ? [h("h3", {}, `Recordings ${version.joint.recordings.join(", ")} together`), jointParts(version.joint)]
      : null,
  ];
}

/** @param {Version} version */
function standardsFoundBad({ notices }) {
  return [
    h(
      "ul",
      { class: "plain" },
      (notices ?? []).map((text) => h("li", {}, text)),
    ),
    h("p", {}, "No certificate of this version is issued. Measure again with another standard."),
  ];
}

/** @param {Version} version */
function heldOutByLeg({ error }) {
  if (!error.heldout_by_leg?.length) return null;
  return [
    h("h3", {}, "Heating predicted from cooling, and the other way round"),
    table(
      [
        { title: "Fitted to", cell: (row) => row.fitted },
        { title: "Tested on", cell: (row) => row.tested },
        { title: "RMS error, deg/s", number: true, cell: (row) => number(row.rms_dps) },
        {
          title: "Over the noise floor",
          number: true,
          cell: (row) =>
            row.rms_dps === null || !error.noise_floor_dps
              ? "–"
              : `${number(row.rms_dps / error.noise_floor_dps, 2)} times`,
        },
        { title: "Data sets", number: true, cell: (row) => `${row.datasets}` },
        error.heldout_by_leg.some((row) => row.why) ? { title: "Note", prose: true, cell: (row) => row.why } : null,
      ],
      error.heldout_by_leg,
      { label: "Left out by leg" },
    ),
  ];
}

/** @param {Version} version */
function leftOut({ left_out: effects }) {
  if (!effects?.length) return null;
  return [
    h("h3", {}, "Fitted, but not exported with the calibration"),
    table(
      [
        { title: "Effect", prose: true, cell: (row) => row.term || idText(row.effect) },
        { title: "Belongs to", cell: (row) => row.origin },
        {
          title: "Size of its error, deg/s RMS",
          number: true,
          cell: (row) => (row.rms_dps === null || row.rms_dps === undefined ? "not known" : number(row.rms_dps)),
        },
      ],
      effects,
      { label: "Not exported" },
    ),
    h(
      "p",
      { class: "muted small" },
      "RMS over the data sets of the fit: the error that remains if these effects are not corrected.",
    ),
  ];
}

/** @param {Version} version */
function remembered({ remembers, axes }) {
  if (!remembers?.length) return null;
  return [
    h("h3", {}, "States kept from sample to sample"),
    h(
      "p",
      { class: "muted small" },
      "This version must be given its samples in order of time, with t_s and the temperature, because each element below is a state that follows the temperature. The state begins at the temperature of the first sample, so the correction is less exact until the unit has warmed up once.",
    ),
    table(
      [
        {
          title: "Element",
          cell: (row) =>
            row.kind === "play" ? "hysteresis (play)" : `${row.is_curved ? "curved " : ""}lag behind the temperature`,
        },
        {
          title: "Time constant or width",
          number: true,
          cell: (row) =>
            `${number(row.parameter)} ${row.unit}${row.cooling_s ? `, cooling ${number(row.cooling_s)} s` : ""}`,
        },
        ...Object.keys(axes).map((axis) => ({
          title: `Axis ${axis}`,
          number: true,
          /** @param {(typeof remembers)[number]} row */
          cell: (row) =>
            `${number(row.size[axis])} ${row.kind === "play" ? "deg/s" : row.is_curved ? "deg/s/K2" : "deg/s/K"}`,
        })),
      ],
      remembers,
      { label: "Remembered in use" },
    ),
  ];
}
