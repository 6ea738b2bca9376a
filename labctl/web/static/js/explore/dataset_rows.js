// Data sets as columns: what the criticism says of each data set, for one axis of the gyro.

/** Return {n, dataset, position, channels: {name: []}, residual, score} of one axis; lists of equal length. */
export function datasetRows(criticism, axis) {
  const sets = criticism.views.sets;
  return { n: sets.dataset.length, dataset: sets.dataset, position: sets.position, channels: sets.channels, residual: sets.residual_dps[axis], score: sets.over_floor[axis] };
}

export const axisNames = (criticism) => Object.keys(criticism.views.sets?.residual_dps ?? {});

/** Group numbers that lie within `width` of each other: [centre of each group], [group of each number]. */
export function groupLevels(values, width, most = 60) {
  const order = values.map((_, k) => k).sort((a, b) => values[a] - values[b]);
  let near = width;
  for (;;) {
    const groups = [];
    const which = new Array(values.length);
    for (const k of order) {
      const last = groups.at(-1);
      if (!last || values[k] - last.first > near) groups.push({ first: values[k], sum: values[k], n: 1 });
      else { last.sum += values[k]; last.n += 1; }
      which[k] = groups.length - 1;
    }
    if (groups.length <= most) return [groups.map((group) => group.sum / group.n), which];
    near = Math.max(near, (values[order.at(-1)] - values[order[0]]) / 500) * 1.5;
  }
}

/** Data-set numbers as `1-20,35`, for the query string. */
export function toRanges(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  const parts = [];
  for (const number of sorted) {
    const last = parts.at(-1);
    if (last && number === last[1] + 1) last[1] = number;
    else parts.push([number, number]);
  }
  return parts.map(([from, to]) => (from === to ? `${from}` : `${from}-${to}`)).join(",");
}

export function fromRanges(text) {
  const found = new Set();
  for (const part of (text ?? "").split(",").filter(Boolean)) {
    const [from, to = from] = part.split("-").map(Number);
    if (Number.isFinite(from) && Number.isFinite(to) && to - from < 100_000) for (let k = from; k <= to; k += 1) found.add(k);
  }
  return found;
}

export const UNITS = {
  table_rate_dps: "deg/s", previous_rate_dps: "deg/s", temperature_c: "deg C", chamber_c: "deg C", t_s: "h", power_s: "h", supply_v: "V", humidity_pct: "%",
};
const NAMES = {
  table_rate_dps: "table rate", previous_rate_dps: "previous rate", temperature_c: "gyro temperature", chamber_c: "chamber temperature",
  t_s: "time", power_s: "time since power-on", supply_v: "supply", humidity_pct: "humidity",
};
/** A channel's values in the unit that its title names: hours for times. */
export const scaled = (name, values) => (UNITS[name] === "h" ? values.map((value) => value / 3600) : values);
export const channelName = (name) => NAMES[name] ?? name.replaceAll("_", " ");
export const channelTitle = (name) => (UNITS[name] ? `${channelName(name)}, ${UNITS[name]}` : channelName(name));
