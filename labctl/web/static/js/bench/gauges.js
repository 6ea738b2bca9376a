// Gauges: chamber and gyro temperature against the set point, and table rate, each on a scale.

import { setChildren, h, svg } from "../core/elements.js";
import { fixed, isNumber, plainNumber } from "../core/format.js";
import { channelName, channelUnit } from "../recordings/channels.js";

/** @import { Campaign, Timeline } from "../../../types/api.js" */
/** @import { Numeric } from "../core/format.js" */

/** Margin of the scale beyond the plan: a gyro is warmer than its chamber. */
const MARGIN_C = 5;

/**
 * One instrument: `set(value, target)` shows a reading on the scale from `low` to `high`.
 * @param {string} title
 * @param {string} unit
 * @param {number} low
 * @param {number} high
 * @param {number} digits
 */
function gauge(title, unit, low, high, digits) {
  const figure = h("span", { class: "gauge-value" }, "–");
  const beside = h("span", { class: "gauge-note" });
  /** @param {number} value */
  const share = (value) => Math.min(Math.max((value - low) / Math.max(high - low, 1e-9), 0), 1) * 200;
  const zero = share(low < 0 && high > 0 ? 0 : low);
  const bar = svg("rect", { y: 5, height: 6, rx: 3, class: "gauge-bar" });
  const wanted = svg("path", { class: "gauge-setpoint" });
  const scale = svg(
    "svg",
    { viewBox: "-4 0 208 16", class: "gauge-scale", "aria-hidden": "true" },
    svg("rect", { x: 0, y: 5, width: 200, height: 6, rx: 3, class: "gauge-track" }),
    bar,
    wanted,
  );
  const element = h(
    "div",
    { class: "gauge" },
    h("span", { class: "gauge-title" }, title),
    h("span", {}, figure, h("span", { class: "gauge-unit" }, unit)),
    scale,
    h("span", { class: "gauge-ends" }, h("span", {}, plainNumber(low)), h("span", {}, plainNumber(high))),
    beside,
  );
  /**
   * @param {Numeric} value
   * @param {Numeric} target
   * @param {string} [text]
   */
  const set = (value, target, text) => {
    figure.textContent = isNumber(value) ? fixed(value, digits) : "–";
    const to = isNumber(value) ? share(value) : zero;
    bar.setAttribute("x", String(Math.min(zero, to)));
    bar.setAttribute("width", String(Math.max(Math.abs(to - zero), isNumber(value) ? 2 : 0)));
    wanted.setAttribute("d", isNumber(target) ? `M${share(target)} 14l-4.5 -11h9z` : "");
    setChildren(beside, text ?? "");
  };
  return Object.assign(element, { set });
}

/**
 * How fast the table turns; a rate that is not known is not rest.
 * @param {Numeric} rate_dps
 */
export const turnsText = (rate_dps) =>
  !isNumber(rate_dps)
    ? "no step has begun"
    : rate_dps
      ? `${(Math.abs(rate_dps) / 6).toPrecision(3)} turns a minute`
      : "at rest";

/**
 * The gauges of a campaign; the scales are those of its plan.
 * @param {Timeline} timeline
 */
export function gauges(timeline) {
  const warm = timeline.temperature_c.filter((value) => value !== null);
  const most = Math.max(1, ...timeline.rate_dps.map((value) => Math.abs(value ?? 0)));
  const [low, high] = warm.length ? [Math.min(...warm, 20) - MARGIN_C, Math.max(...warm, 30) + MARGIN_C] : [0, 50];
  const chamber = gauge("Chamber", "°C", low, high, 2);
  const gyro = gauge("Gyro", "°C", low, high, 2);
  const rate = gauge("Table rate", "deg/s", -most, most, 3);
  const driven = timeline.kind.includes("home"); // a bench on which units are turned by hand has neither
  const references = h("p", { class: "gauge-note", hidden: true });
  const dials = h("div", { class: "gauges" }, driven ? [chamber, gyro, rate] : gyro);
  const element = h("div", {}, dials, references);
  /**
   * @param {Numeric} value
   * @param {Numeric} target
   */
  const apart = (value, target) => {
    if (!isNumber(value)) return "no reading yet";
    if (!isNumber(target)) return driven ? "no set point yet" : "by its own thermometer";
    const off = `${Math.abs(value - target).toFixed(2)} K ${value > target ? "above" : "below"}`;
    return `set point ${plainNumber(target)} °C, ${Math.abs(value - target) < 0.005 ? "there" : off}`;
  };
  /**
   * @param {Pick<Campaign, "chamber_c" | "gyro_c" | "rate_dps" | "references">} status
   * @param {Numeric} setpoint_c
   */
  const set = ({ chamber_c, gyro_c, rate_dps, references: beside }, setpoint_c) => {
    chamber.set(chamber_c, setpoint_c, apart(chamber_c, setpoint_c));
    gyro.set(gyro_c, setpoint_c, apart(gyro_c, setpoint_c));
    rate.set(rate_dps, null, turnsText(rate_dps));
    const read = Object.entries(beside).map(
      ([column, value]) => `${channelName(column)} ${plainNumber(value, 6)} ${channelUnit(column)}`,
    );
    references.hidden = !read.length;
    setChildren(references, `Readings of the reference instruments: ${read.join(", ")}`);
  };
  return Object.assign(element, { set });
}
