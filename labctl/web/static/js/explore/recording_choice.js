// Several recordings of a unit as one: choose them, compare a version with them, fit a model to them.

import { setChildren, h } from "../core/elements.js";
import { count } from "../core/format.js";
import { button } from "../core/components.js";
import { navigate, query } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { fitForm } from "./fit_form.js";
import { inAddress, recordingsText } from "./chosen_recordings.js";

/** @import { RecordingRow } from "../../../types/api.js" */
/** @import { Chosen } from "./chosen_recordings.js" */

/** Recordings with a table's rate, or at rest, go together; of the others each stands alone. */
const TOGETHER = ["rates", "rest"];

/** @param {readonly RecordingRow[]} own */
const togetherOf = (own) => own.filter((row) => TOGETHER.includes(row.motion) && row.kind !== "coefficients");

/**
 * A card to choose several recordings; null where the unit has none that go together.
 * @param {string} serial
 * @param {number | undefined} version
 * @param {readonly RecordingRow[]} own the unit's recordings
 * @param {Chosen} now
 */
export function recordingChoice(serial, version, own, now) {
  const rows = togetherOf(own).sort((a, b) => a.id - b.id);
  if (rows.length < 2) return null;
  const picked = new Set(now.recordings.length > 1 ? now.recordings : [now.recording]);
  /** @returns {Chosen} */
  const chosen = () => {
    const recordings = [...picked].sort((a, b) => a - b);
    return { recording: recordings.at(-1) ?? now.recording, recordings };
  };
  const acts = h("div", { class: "row space-between", style: "align-items: end" });
  const fill = () => {
    if (picked.size < 2) return setChildren(acts, h("p", { class: "muted small" }, "Choose two recordings or more."));
    const of = chosen();
    return setChildren(
      acts,
      version === undefined
        ? null
        : button(`Check calibration version ${version} against ${recordingsText(of)}`, () =>
            navigate(`/explore?${changedQuery("", { unit: serial, version, view: query().view, ...inAddress(of) })}`),
          ),
      fitForm(serial, chosen, rows.find((row) => picked.has(row.id))?.motion, "Fit them together"),
    );
  };
  /** @param {RecordingRow} row */
  const choice = (row) => {
    /** @type {HTMLInputElement} */
    const box = h("input", {
      type: "checkbox",
      checked: picked.has(row.id),
      onchange: () => {
        if (box.checked) picked.add(row.id);
        else picked.delete(row.id);
        fill();
      },
    });
    const size = `${count(row.datasets)} data ${row.datasets === 1 ? "set" : "sets"}`;
    return h("label", { class: "row tight" }, box, `Recording ${row.id}`, h("span", { class: "muted small" }, size));
  };
  fill();
  return h(
    "details",
    { class: "card stack", open: now.recordings.length > 1 },
    h("summary", {}, h("strong", {}, "Several recordings together")),
    h(
      "p",
      { class: "muted small" },
      "The fit then has one value of each sensor coefficient for all recordings. In addition it estimates the differences from one power-on, day or mounting to the next (repeatability).",
    ),
    h("div", { class: "row", role: "group", "aria-label": "Recordings" }, rows.map(choice)),
    acts,
  );
}
