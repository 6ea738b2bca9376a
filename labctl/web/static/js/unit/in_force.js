// The version in force: by whom, until when, its errors, and the files to download.

import { h } from "../core/elements.js";
import { day, instant, number } from "../core/format.js";
import { factList, modelName, notice } from "../core/components.js";
import { exportFiles } from "./export_files.js";
import { causesNotKnown, overridden, persons, verdictChip } from "./certification.js";

/** @import { CalibrationRow, Certification, Unit } from "../../../types/api.js" */

/**
 * @param {Unit} unit
 * @param {readonly CalibrationRow[]} rows
 * @param {Certification | undefined} force
 */
export function inForce(unit, rows, force) {
  if (!unit.certified_version) {
    return notice(
      "warn",
      h(
        "p",
        {},
        h("strong", {}, "No calibration is in force. "),
        "Programs that request the calibration of this unit get an error until a version is certified.",
      ),
    );
  }
  const row = rows.find((each) => each.version === unit.certified_version);
  const left = force?.due ? Math.ceil((Date.parse(force.due) - Date.now()) / 86_400_000) : null;
  return h(
    "div",
    { class: "stack" },
    factList([
      ["In force", `version ${unit.certified_version}`, null, row ? modelName(row.model) : null],
      ["Certified by", force ? persons(force) : "–", null, force ? instant(force.at) : null],
      [
        "Due",
        force?.due ? day(force.due) : "no date",
        null,
        left === null ? null : left < 0 ? `${-left} days ago` : `in ${left} days`,
      ],
      !force || force.override === null
        ? null
        : [
            "Verdict when certified",
            verdictChip(force),
            null,
            force.verdict_recording ? `recording ${force.verdict_recording}` : null,
          ],
      ["RMS error", number(row?.rms_dps), "deg/s"],
      ["RMS error at temperatures left out of the fit", number(row?.heldout_rms_dps), "deg/s"],
    ]),
    force?.override ? overridden(force) : null,
    force ? causesNotKnown(force) : null,
    left !== null && left < 0
      ? notice("bad", "The date until which this calibration is valid has passed; calibrate the unit again.")
      : null,
    h("div", { class: "screen-only" }, exportFiles(unit, null)),
  );
}
