// Gauges: chamber and gyro temperature against the set point, and table rate, each on a scale.

import { setChildren, h, svg } from "../core/elements.js";
import { plainNumber } from "../core/format.js";

/** Margin of the scale beyond the plan: a gyro is warmer than its chamber. */
const MARGIN_C = 5;

/** One instrument: `set(value, target)` shows a reading on the scale from `low` to `high`. */
function gauge(title, unit, low, high, digits) {
  const figure = h("span", { class: "gauge-value" }, "–");
  const beside = h("span", { class: "gauge-note" });
  const share = (value) => Math.min(Math.max((value - low) / Math.max(high - low, 1e-9), 0), 1) * 200;
  const zero = share(low < 0 && high > 0 ? 0 : low);
  const bar = svg("rect", { y: 5, height: 6, rx: 3, class: "gauge-bar" });
  const wanted = svg("path", { class: "gauge-setpoint" });
  const scale = svg(
    "svg",
    { viewBox: "-4 0 208 26", class: "gauge-scale", "aria-hidden": "true" },
    svg("rect", { x: 0, y: 5, width: 200, height: 6, rx: 3, class: "gauge-track" }),
    bar,
    wanted,
    svg("text", { x: 0, y: 24 }, plainNumber(low)),
    svg("text", { x: 200, y: 24, "text-anchor": "end" }, plainNumber(high)),
  );
  const element = h(
    "div",
    { class: "gauge" },
    h("span", { class: "gauge-title" }, title),
    h("span", {}, figure, h("span", { class: "gauge-unit" }, unit)),
    scale,
    beside,
  );
  element.set = (value, target, text) => {
    const there = Number.isFinite(value);
    figure.textContent = there ? value.toFixed(digits) : "–";
    const to = there ? share(value) : zero;
    bar.setAttribute("x", Math.min(zero, to));
    bar.setAttribute("width", Math.max(Math.abs(to - zero), there ? 2 : 0));
    const mark = share(target);
    wanted.setAttribute("d", Number.isFinite(target) ? `M${mark} 14l-4.5 -11h9z` : "");
    setChildren(beside, text ?? "");
  };
  return element;
}

/** The gauges of a campaign; the scales are those of its plan. */
export function gauges(timeline) {
  const warm = timeline.temperature_c.filter((value) => value !== null);
  const most = Math.max(1, ...timeline.rate_dps.map((value) => Math.abs(value ?? 0)));
  const [low, high] = warm.length ? [Math.min(...warm, 20) - MARGIN_C, Math.max(...warm, 30) + MARGIN_C] : [0, 50];
  const chamber = gauge("Chamber", "deg C", low, high, 2);
  const gyro = gauge("Gyro", "deg C", low, high, 2);
  const rate = gauge("Table rate", "deg/s", -most, most, 3);
  const element = h("div", { class: "gauges" }, chamber, gyro, rate);
  const apart = (value, target) =>
    Number.isFinite(value) && Number.isFinite(target)
      ? `set point ${plainNumber(target)} deg C, ${Math.abs(value - target) < 0.005 ? "there" : `${Math.abs(value - target).toFixed(2)} K ${value > target ? "above" : "below"}`}`
      : Number.isFinite(value)
        ? "no set point yet"
        : "no reading yet";
  element.set = (status, setpoint_c) => {
    const number = (value) => (value === null || value === undefined ? NaN : value);
    chamber.set(number(status.chamber_c), setpoint_c ?? NaN, apart(number(status.chamber_c), setpoint_c ?? NaN));
    gyro.set(number(status.gyro_c), setpoint_c ?? NaN, apart(number(status.gyro_c), setpoint_c ?? NaN));
    rate.set(
      number(status.rate_dps),
      NaN,
      status.rate_dps ? `${(Math.abs(status.rate_dps) / 6).toPrecision(3)} turns a minute` : "at rest",
    );
  };
  return element;
}
