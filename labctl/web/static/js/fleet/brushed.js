// What a brush over a control chart selects: the groups whose points lie in a span of time, with their means.

/** @import { FleetChartPoint } from "../../../types/api.js" */
/** @typedef {{ level: string, units: number, mean: number, off: number | null }} Brushed */

/**
 * The groups with units that were measured in a span of days, those farthest from the mean of all first. `off` is the
 * distance of the group from the mean of all other units of the chart, in the unit of the coefficient; null
 * where there are no other units.
 * @param {readonly FleetChartPoint[]} points
 * @param {string} from day such as 2026-01-05, or empty
 * @param {string} to day, or empty; the whole day counts
 * @returns {Brushed[]}
 */
export function brushed(points, from, to) {
  const inside = points.filter(({ at }) => (!from || at.slice(0, 10) >= from) && (!to || at.slice(0, 10) <= to));
  /** @type {Map<string, { units: number, sum: number }>} */
  const levels = new Map();
  for (const { level, units, mean } of inside) {
    const sums = levels.get(level) ?? { units: 0, sum: 0 };
    levels.set(level, { units: sums.units + units, sum: sums.sum + units * mean });
  }
  const units = points.reduce((sum, point) => sum + point.units, 0);
  const total = points.reduce((sum, point) => sum + point.units * point.mean, 0);
  return [...levels]
    .map(([level, own]) => {
      const others = units - own.units;
      const off = others ? own.sum / own.units - (total - own.sum) / others : null;
      return { level, units: own.units, mean: own.sum / own.units, off };
    })
    .sort((a, b) => Math.abs(b.off ?? 0) - Math.abs(a.off ?? 0));
}
