// A recording by what moved the unit, uncorrected: a card for the page of a recording.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { cardWithHeader, loadInto } from "../core/components.js";
import { option, toggleGroup } from "../core/fields.js";
import { BY_AXIS, motionView } from "./view.js";

/** @import { Motion, RecordingRow } from "../../../types/api.js" */

/** @type {Record<RecordingRow["motion"], string>} */
export const MOTION_NAMES = { rates: "table", rest: "rest", turns: "turns", profile: "profile", poses: "poses" };
/** @type {Record<RecordingRow["motion"], string>} */
export const MOTION_TITLES = {
  rates: "On a table",
  rest: "At rest",
  turns: "Turns by known angles",
  profile: "Rate that changes",
  poses: "Poses, turned by hand between rests",
};

/**
 * @param {number} recording
 * @param {RecordingRow["motion"]} motion
 * @param {readonly string[]} axes
 * @param {AbortSignal} signal
 */
export function motionCard(recording, motion, axes, signal) {
  const place = h("div", { class: "stack" });
  let axis = axes[0];
  /** @type {Motion | null} */
  let found = null;
  const show = () =>
    loadInto(place, "Reading the recording", async () => {
      found ??= await get("/api/recordings/{recording}/motion", { path: { recording }, signal });
      return motionView(found, axis);
    });
  show();
  const choice =
    axes.length > 1 && BY_AXIS.has(motion)
      ? toggleGroup(
          "Axis of the gyro",
          axes.map((each) => option(each, `axis ${each}`)),
          axis,
          (value) => {
            axis = value;
            show();
          },
        )
      : null;
  return cardWithHeader(MOTION_TITLES[motion], choice, place);
}
