// A sparkline: the error of each version over the noise floor, on one logarithmic scale for every unit.

import { h, svg } from "./elements.js";
import { number } from "./format.js";

/** @import { Unit } from "../../../types/api.js" */

const [WIDTH, HEIGHT, RIM] = [72, 24, 3];
/** What lies outside is drawn at the edge; the floor, 1, is a line. */
export const LEAST_RATIO = 0.5;
export const LARGEST_RATIO = 100;

/**
 * Height of a ratio in the picture, px from its top.
 * @param {number} ratio
 */
export function heightOf(ratio) {
  const inside = Math.min(Math.max(ratio, LEAST_RATIO), LARGEST_RATIO);
  const share = Math.log(inside / LEAST_RATIO) / Math.log(LARGEST_RATIO / LEAST_RATIO);
  return HEIGHT - RIM - share * (HEIGHT - 2 * RIM);
}

/**
 * The newest error in figures beside its course over the versions; a dash where no version has one.
 * @param {Unit["newest_errors"]} errors
 */
export function errorSparkline({ version, over_floor }) {
  const known = version.flatMap((of, k) => (over_floor[k] === null ? [] : [{ of, ratio: Number(over_floor[k]) }]));
  const newest = known.at(-1);
  if (!newest) return "–";
  const step = known.length > 1 ? (WIDTH - 2 * RIM) / (known.length - 1) : 0;
  const points = known.map(
    ({ ratio }, k) => `${(WIDTH - RIM - (known.length - 1 - k) * step).toFixed(1)},${heightOf(ratio).toFixed(2)}`,
  );
  const course = known.map(({ of, ratio }) => `version ${of}: ${number(ratio)}`).join(", ");
  const words = `Error over the noise floor, ${course}`;
  const [x, y] = points[points.length - 1].split(",");
  return h(
    "span",
    { class: "sparkline", title: words },
    svg(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT, role: "img", "aria-label": words },
      svg("line", { class: "floor", x1: 0, x2: WIDTH, y1: heightOf(1), y2: heightOf(1) }),
      svg("polyline", { points: points.join(" ") }),
      svg("circle", { cx: x, cy: y, r: 2.4 }),
    ),
    h("span", { class: "sparkline-value" }, number(newest.ratio)),
  );
}
