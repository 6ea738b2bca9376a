// Models to begin with, by what moved the unit.

/** @import { RecordingRow } from "../../../types/api.js" */

/** @typedef {{ id: string, text: string, body: { model?: string, effects?: string[] } }} FirstModel */

/**
 * @param {string} id
 * @param {string} text
 * @returns {FirstModel}
 */
const named = (id, text) => ({ id, text, body: { model: id } });

const ON_TABLE = [
  named("bias_scale", "bias and scale factor"),
  named("ojeda2000", "Ojeda 2000: polynomial in rate and temperature"),
  named("yang2018", "Yang 2018: matrices over temperature"),
  named("single_temperature", "one temperature"),
];
const FOLLOWING = ["bias", "scale_factor", "time_delay", "bandwidth"];

/** @type {Record<RecordingRow["motion"], FirstModel[]>} */
const BY_MOTION = {
  rates: ON_TABLE,
  rest: [named("bias_temperature", "bias over temperature"), named("bias", "bias, without a thermometer")],
  turns: [named("turns", "turns by known angles")],
  profile: [
    { id: "following", text: "bias, scale factor, delay and bandwidth", body: { effects: FOLLOWING } },
    { id: "linear", text: "bias and scale factor only", body: { effects: FOLLOWING.slice(0, 2) } },
  ],
  poses: [named("poses", "turns by hand between rests")],
};

/** @param {RecordingRow["motion"] | undefined} motion */
export const firstModels = (motion) => BY_MOTION[motion ?? "rates"];

/**
 * What a held-out error is of, by what moved the unit.
 * @param {RecordingRow["motion"] | undefined} motion
 */
export const heldOutName = (motion) =>
  motion === "turns" || motion === "poses" ? "at turns left out" : "at temperatures left out";
