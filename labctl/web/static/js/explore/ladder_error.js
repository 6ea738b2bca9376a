// Which error a version has on one recording; no DOM here.

/** @import { Ladder } from "../../../types/api.js" */

/**
 * The error of a version on one recording alone; the RMS of a fit to several recordings is none.
 * @param {Ladder["recording"]} recording
 * @param {Pick<Ladder["steps"][number], "applied_rms_dps" | "recording" | "recordings" | "rms_dps">} step
 */
export const errorOn = (recording, { applied_rms_dps, recording: own, recordings, rms_dps }) =>
  applied_rms_dps ?? (own === recording && recordings.length < 2 ? rms_dps : null);
