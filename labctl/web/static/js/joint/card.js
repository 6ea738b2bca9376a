// What several recordings say together: repeatability, agreement, each predicted by the others.

import { h } from "../core/elements.js";
import { idText, number, probabilityText, sizeText } from "../core/format.js";
import { cardWithHeader, chip, table } from "../core/components.js";
import { deviationTexts } from "./deviation.js";
import { shiftFigures } from "./shifts.js";

/** @import { Joint } from "../../../types/api.js" */
/** @typedef {Joint["repeatability"][string][number]} Repeatability */

/** @param {number | null} p */
const chance = (p) => (p === null ? "–" : p < 1e-6 ? "below 10⁻⁶" : number(p, 2));

/** @param {Joint} joint */
export function jointCard(joint) {
  return cardWithHeader(`Recordings ${joint.recordings.join(", ")} together`, null, ...jointParts(joint));
}

/** @param {Joint} joint */
export function jointParts(joint) {
  return [
    joint.text.map((line) => h("p", {}, line)),
    repeatability(joint),
    shiftFigures(joint),
    agreement(joint),
    heldOut(joint),
  ];
}

/** @param {Joint} joint */
function repeatability(joint) {
  const rows = Object.entries(joint.repeatability).flatMap(([axis, each]) => each.map((one) => ({ axis, ...one })));
  if (!rows.length) return null;
  /**
   * @param {typeof rows[number]} row
   * @param {number | null} value
   */
  const size = ({ term, unit }, value) => sizeText(value, unit, term);
  return [
    h("h3", {}, "Repeatability"),
    table(
      [
        { title: "Axis", cell: (row) => row.axis },
        { title: "What", prose: true, cell: (row) => row.term },
        { title: "Standard deviation", number: true, cell: (row) => deviationTexts(row)[0] },
        { title: "u", number: true, cell: (row) => deviationTexts(row)[1] },
        {
          title: "95 %",
          number: true,
          cell: (row) => `${size(row, row.low)} to ${size(row, row.high)}`,
        },
        { title: "Chance of noise alone", number: true, cell: (row) => probabilityText(row.p_value) },
        { title: "Shift", cell: (row) => (row.seen ? chip("seen", "warn") : chip("not seen", "good")) },
      ],
      rows,
      { label: "Repeatability" },
    ),
  ];
}

/** @param {Joint} joint */
function agreement(joint) {
  if (joint.not_compared) return null; // a sentence of the text says why
  return [
    h("h3", {}, "Agreement of the recordings, each fitted alone"),
    table(
      [
        { title: "Effect", cell: (row) => idText(row.effect) },
        {
          title: "Agreement",
          cell: (row) =>
            row.agree
              ? chip(row.shift && row.p_value_beside_shifts === null ? "agree beside a shift" : "agree", "good")
              : chip("differ", "bad"),
        },
        { title: "chi²", number: true, cell: (row) => number(row.chi2) },
        { title: "Degrees of freedom", number: true, cell: (row) => `${row.freedom}` },
        { title: "p-value", number: true, cell: (row) => chance(row.p_value) },
        { title: "p-value beside shifts", number: true, cell: (row) => chance(row.p_value_beside_shifts) },
        {
          title: "Name of a difference that is equal at all temperatures",
          prose: true,
          cell: (row) => row.shift ?? "–",
        },
      ],
      joint.agreement,
      { label: "Agreement" },
    ),
  ];
}

/** @param {Joint} joint */
function heldOut(joint) {
  return [
    h("h3", {}, "Each recording predicted by a fit to the others"),
    h(
      "p",
      { class: "muted small" },
      "Error to expect on a later day; the shift from one power-on and day to the next is part of it.",
    ),
    table(
      [
        {
          title: "Recording",
          cell: (row) => h("a", { href: `/recordings/${row.recording}` }, `Recording\u00a0${row.recording}`),
        },
        { title: "RMS error, deg/s", number: true, cell: (row) => number(row.rms_dps) },
        { title: "Note", prose: true, cell: (row) => row.why },
      ],
      joint.held_out,
      { label: "Recordings left out of the fit" },
    ),
    joint.heldout_rms_dps === null
      ? null
      : h("p", {}, `All recordings together: ${number(joint.heldout_rms_dps)} deg/s RMS.`),
  ];
}
