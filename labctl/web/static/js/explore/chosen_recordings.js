// Which version is compared with which recordings: one, or several as one; in the address, in a query and in words.

/** @import { RecordingRow, Unit, Version } from "../../../types/api.js" */

/** @typedef {{ recording: number, recordings: readonly number[] }} Chosen `recording` is the newest of them */

/**
 * Numbers of an address like `7,8,9` that are known, rising.
 * @param {string | undefined} text
 * @param {readonly number[]} known
 */
export const numbersIn = (text, known) =>
  [...new Set((text ?? "").split(",").map(Number))].filter((each) => known.includes(each)).sort((a, b) => a - b);

/**
 * For a query or a body: `recording`, or `recordings` where there are several.
 * @param {Chosen} chosen
 * @returns {{ recording: number } | { recordings: number[] }}
 */
export const asked = ({ recording, recordings }) =>
  recordings.length > 1 ? { recordings: [...recordings] } : { recording };

/**
 * For the address of the page.
 * @param {Chosen} chosen
 */
export const inAddress = ({ recording, recordings }) =>
  recordings.length > 1
    ? { recordings: recordings.join(","), recording: null }
    : { recording: String(recording), recordings: null };

/**
 * "recording 7", "recordings 7, 8 and 9".
 * @param {Chosen} chosen
 */
export function recordingsText({ recording, recordings }) {
  if (recordings.length < 2) return `recording ${recording}`;
  return `recordings ${recordings.slice(0, -1).join(", ")} and ${recordings.at(-1)}`;
}

/**
 * What a residual is of: the model as the version was fitted, or fitted again to other recordings.
 * @param {Chosen & { version: number, calibration: Pick<Version, "recordings"> }} state
 */
export function residualText({ version, recording, recordings, calibration }) {
  const own = [...calibration.recordings].sort().join();
  const which = recordingsText({ recording, recordings });
  return own === [...recordings].sort().join()
    ? `The residual is what the model of version ${version} leaves of ${which}, to which it was fitted: what this model cannot describe.`
    : `The model of version ${version} was refitted to ${which}, so the residual shows what this model cannot describe. Compare, above, shows the version without refitting.`;
}

/**
 * The newest recording with at least half as many data sets as the largest. An experiment of a diagnosis, which rarely
 * determines a model alone, and what a campaign measures that has not ended are taken only where there is no other.
 * @param {readonly Pick<RecordingRow, "id" | "datasets" | "unfinished" | "experiment">[]} own
 */
export function usualRecording(own) {
  const ended = own.filter((row) => !row.unfinished);
  const whole = ended.filter((row) => !row.experiment);
  const rows = whole.length ? whole : ended.length ? ended : own;
  const most = Math.max(...rows.map((row) => row.datasets));
  return Math.max(...rows.filter((row) => 2 * row.datasets >= most).map((row) => row.id));
}

/**
 * The version that is shown where none is asked for: the one in force, as on the page of the unit; else the newest.
 * @param {Pick<Unit, "calibrations" | "certified_version">} unit
 * @returns {number | undefined} undefined where the unit has no version
 */
export const usualVersion = ({ calibrations, certified_version: inForce }) =>
  inForce ?? (calibrations.length ? Math.max(...calibrations) : undefined);
