// A point of the trend of a unit: what a version leaves of one recording, computed again from its readings.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { pythonValue } from "../core/figure_point.js";

/** @import { Trend } from "../../../types/api.js" */
/** @import { Asked } from "../core/figure_point.js" */

/** @typedef {"bias" | "scale_factor" | "error" | "as_found" | "as_left"} Quantity */

/** @type {Record<Quantity, string>} */
const NAMES = {
  bias: "bias left",
  scale_factor: "scale factor left",
  error: "RMS error",
  as_found: "RMS error as found",
  as_left: "RMS error as left",
};

/**
 * @param {string} serial
 * @param {number} version
 * @param {number} recording
 * @param {Quantity} quantity
 * @param {string} axis empty: an error over all axes
 * @returns {Asked}
 */
export function trendPoint(serial, version, recording, quantity, axis = "") {
  const asked = { version, recording, quantity, axis };
  const of = axis ? `, axis=${pythonValue(axis)}` : "";
  return {
    key: ["trend", version, recording, quantity, axis].filter((part) => part !== "").join("_"),
    name: `${NAMES[quantity]} on recording ${recording}${axis ? `, axis ${axis}` : ""}, version ${version}`,
    read: () => get("/api/units/{serial}/trend/point", { path: { serial }, query: asked }),
    call: `client.trend_point(${pythonValue(serial)}, recording=${recording}, quantity=${pythonValue(quantity)}${of}, version=${version})`,
    links: () => h("a", { class: "button tiny", href: `/recordings/${recording}` }, `Open recording ${recording}`),
  };
}

/**
 * The point that an address names; null where the trend has no such point.
 * @param {string} serial
 * @param {Trend} trend
 * @param {string} key
 */
export function askedTrend(serial, trend, key) {
  const all = trend.points.flatMap(({ recording, axes }) => [
    .../** @type {const} */ (["error", "as_found", "as_left"]).map((quantity) =>
      trendPoint(serial, trend.version, recording, quantity),
    ),
    ...Object.keys(axes).flatMap((axis) =>
      /** @type {const} */ (["bias", "scale_factor"]).map((quantity) =>
        trendPoint(serial, trend.version, recording, quantity, axis),
      ),
    ),
  ]);
  return all.find((each) => each.key === key) ?? null;
}
