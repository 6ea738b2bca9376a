// State of the explore page: axis, selected data sets, overlay. Listeners are called on each change.

import { updateQuery } from "../core/router.js";
import { toRanges, fromRanges } from "./dataset_rows.js";

/** @import { Criticism, RecordingRow, Version } from "../../../types/api.js" */

/** @typedef {"axis" | "pick" | "overlay"} Change */
/** @typedef {{ effect: string, name: string, values: (number | null)[] }} Overlay */
/**
 * @typedef {object} Given
 * @property {string} serial
 * @property {number} version
 * @property {number[]} versions
 * @property {number} recording the newest of `recordings`
 * @property {number[]} recordings
 * @property {RecordingRow["motion"]} motion what moved the unit
 * @property {Criticism} criticism
 * @property {Version} calibration
 * @property {string} axis
 * @property {string | undefined} pick the selected data sets as `1-20,35`
 */

export class ExploreState {
  /** @param {Given} given */
  constructor(given) {
    this.serial = given.serial;
    this.version = given.version;
    this.versions = given.versions;
    this.recording = given.recording;
    this.recordings = given.recordings;
    this.motion = given.motion;
    this.criticism = given.criticism;
    this.calibration = given.calibration;
    this.axis = given.axis;
    this.pick = fromRanges(given.pick);
    /** @type {Overlay | null} */
    this.overlay = null; // {name, values: one for each data set}, plotted over the residual
    /** @type {((change: Change) => unknown)[]} */
    this.listeners = [];
  }

  /** @param {(change: Change) => unknown} listener */
  onchange(listener) {
    this.listeners.push(listener);
  }

  /**
   * Select data sets by number; an empty list clears the selection.
   * @param {Iterable<number>} numbers
   */
  select(numbers) {
    this.pick = new Set(numbers);
    updateQuery({ pick: this.pick.size ? toRanges(this.pick) : null });
    this.notify("pick");
  }

  /** @param {Overlay | null} overlay */
  setOverlay(overlay) {
    this.overlay = overlay;
    this.notify("overlay");
  }

  /** @param {string} axis */
  selectAxis(axis) {
    this.axis = axis;
    /** @type {Overlay | null} */
    this.overlay = null;
    updateQuery({ axis });
    this.notify("axis");
  }

  /** @param {Change} what */
  notify(what) {
    for (const listener of this.listeners) listener(what);
  }
}
