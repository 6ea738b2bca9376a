// What the event stream has told of a campaign since this tab was opened, as columns for a rolling picture.

const KEPT = 3000;
const held = new Map();

/** The history of a campaign; it outlives the page, so that coming back does not begin anew. */
export function historyOf(campaign) {
  if (!held.has(campaign)) held.set(campaign, { t_s: [], chamber_c: [], gyro_c: [], rate_dps: [], setpoint_c: [] });
  return held.get(campaign);
}

/** Take a progress message in. `t_s` is the campaign's own time: a simulated bench may run faster than the wall's clock. */
export function take(history, status, t_s, setpoint_c) {
  if (!Number.isFinite(t_s) || (history.t_s.length && t_s <= history.t_s.at(-1))) return;
  const row = { t_s, chamber_c: status.chamber_c, gyro_c: status.gyro_c, rate_dps: status.rate_dps, setpoint_c };
  for (const [name, values] of Object.entries(history)) {
    values.push(row[name] ?? null);
    if (values.length > KEPT) values.splice(0, values.length - KEPT);
  }
}

/**
 * Seconds of the campaign that have passed. The service forecasts the end as its own now plus what is left, and progress is
 * what is left of what was expected: together they give its now, whatever clock the bench runs on.
 */
export function passed(status, expected_s) {
  if (!status.expected_end || !status.started_at) return NaN;
  const now = Date.parse(status.expected_end) / 1000 - left(status, expected_s);
  return now - Date.parse(status.started_at) / 1000;
}

export const left = (status, expected_s) => expected_s * (1 - status.progress);
