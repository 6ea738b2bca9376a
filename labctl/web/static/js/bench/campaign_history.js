// Progress messages of a campaign since this tab was opened, as columns for a plot.

import { isNumber } from "../core/format.js";

/** @import { Campaign } from "../../../types/api.js" */

export const MAX_POINTS = 3000;
/** @typedef {Record<"t_s" | "chamber_c" | "gyro_c" | "rate_dps" | "setpoint_c", (number | null)[]>} History */
/** @type {Map<number, Columns>} */
/**
 * @typedef {object} Columns columns of equal length
 * @property {number[]} t_s
 * @property {(number | null)[]} chamber_c
 * @property {(number | null)[]} gyro_c
 * @property {(number | null)[]} rate_dps
 * @property {(number | null)[]} setpoint_c
 */
/** @typedef {Pick<Campaign, "t_s" | "chamber_c" | "gyro_c" | "rate_dps">} Status */

/** @type {Map<number, Columns>} */
const histories = new Map();

/** @returns {Columns} */
export const emptyHistory = () => ({ t_s: [], chamber_c: [], gyro_c: [], rate_dps: [], setpoint_c: [] });

/**
 * The history of a campaign; kept when the page is left, so that it continues on return.
 * @param {number} campaign
 */
export function campaignHistory(campaign) {
  const found = histories.get(campaign) ?? emptyHistory();
  histories.set(campaign, found);
  return found;
}

/**
 * Append a progress message. Its time is campaign time: a simulated bench may run faster than wall-clock time.
 * @param {Columns} history
 * @param {Status} status
 * @param {number | null} setpoint_c
 */
export function appendStatus(history, status, setpoint_c) {
  const { t_s, chamber_c, gyro_c, rate_dps } = status;
  if (!isNumber(t_s) || t_s <= (history.t_s.at(-1) ?? -Infinity)) return;
  history.t_s.push(t_s);
  history.chamber_c.push(chamber_c);
  history.gyro_c.push(gyro_c);
  history.rate_dps.push(rate_dps);
  history.setpoint_c.push(setpoint_c);
  for (const values of Object.values(history)) values.splice(0, values.length - MAX_POINTS);
}

/**
 * Remaining time, s: `progress` is the elapsed share of the expected duration.
 * @param {{ progress: number }} status
 * @param {number} expected_s
 */
export const remainingSeconds = (status, expected_s) => expected_s * (1 - status.progress);
