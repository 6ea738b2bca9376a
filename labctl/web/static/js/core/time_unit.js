// The unit of a time axis.

const HOUR = { name: "h", seconds: 3600 };
const MINUTE = { name: "min", seconds: 60 };
const SECOND = { name: "s", seconds: 1 };
const MINUTES_FROM_S = 600;
/** A course of a campaign that is longer than this is drawn over hours. */
const CAMPAIGN_HOURS_FROM_S = 10_800;

/**
 * The unit for a span of time: hours from `hoursFrom_s` on, minutes from 10 min on, else seconds.
 * @param {number} span_s
 * @param {number} hoursFrom_s
 */
export const timeUnit = (span_s, hoursFrom_s) =>
  span_s >= hoursFrom_s ? HOUR : span_s >= MINUTES_FROM_S ? MINUTE : SECOND;

/**
 * The unit for times of a campaign between two of them: figures beside each other, which begin when the page was opened,
 * have the same one.
 * @param {readonly number[]} t_s times of the campaign, rising
 */
export function campaignTimeUnit(t_s) {
  const [from, until] = [t_s[0] ?? 0, t_s.at(-1) ?? 0];
  return until - from >= CAMPAIGN_HOURS_FROM_S ? HOUR : until >= MINUTES_FROM_S ? MINUTE : SECOND;
}
