// Progress messages of a campaign since this tab was opened, as columns for a plot.

const MAX_POINTS = 3000;
const histories = new Map();

/** The history of a campaign; kept when the page is left, so that it continues on return. */
export function campaignHistory(campaign) {
  if (!histories.has(campaign))
    histories.set(campaign, { t_s: [], chamber_c: [], gyro_c: [], rate_dps: [], setpoint_c: [] });
  return histories.get(campaign);
}

/** Append a progress message. Its time is campaign time: a simulated bench may run faster than wall-clock time. */
export function appendStatus(history, status, setpoint_c) {
  const { t_s } = status;
  if (!Number.isFinite(t_s) || (history.t_s.length && t_s <= history.t_s.at(-1))) return;
  const row = { t_s, chamber_c: status.chamber_c, gyro_c: status.gyro_c, rate_dps: status.rate_dps, setpoint_c };
  for (const [name, values] of Object.entries(history)) {
    values.push(row[name] ?? null);
    if (values.length > MAX_POINTS) values.splice(0, values.length - MAX_POINTS);
  }
}

/** Remaining time, s: `progress` is the elapsed share of the expected duration. */
export const remainingSeconds = (status, expected_s) => expected_s * (1 - status.progress);
