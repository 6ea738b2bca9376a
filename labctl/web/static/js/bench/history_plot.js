// History plot: temperatures above, table rate below.

import { colour, figure } from "../core/figure.js";
import { campaignTimeUnit } from "../core/time_unit.js";

/** @import { Columns } from "./campaign_history.js" */

const MIN_INTERVAL_MS = 1000;

/** @param {Columns} history */
export function historyPlot(history) {
  const draw = () => {
    const { t_s } = history;
    const unit = campaignTimeUnit(t_s);
    const x = t_s.map((t) => t / unit.seconds);
    /**
     * @param {string} name
     * @param {readonly (number | null)[]} values
     * @param {string} shade
     * @param {{ unit?: string, line?: object, trace?: object }} [more]
     */
    const line = (name, values, shade, more = {}) => ({
      type: "scatter",
      mode: "lines",
      name,
      x,
      y: values,
      line: { color: colour(shade), width: 1.8, ...more.line },
      hovertemplate: `%{y:.5~g} ${more.unit ?? "°C"}<extra>${name}</extra>`,
      ...more.trace,
    });
    return {
      data: [
        line("set point", history.setpoint_c, "border-strong", { line: { dash: "dot", shape: "hv" } }),
        line("chamber", history.chamber_c, "axis-x"),
        line("gyro", history.gyro_c, "axis-y"),
        line("table rate", history.rate_dps, "axis-z", {
          unit: "deg/s",
          line: { shape: "hv" },
          trace: { yaxis: "y2" },
        }),
      ],
      layout: {
        margin: { l: 76, r: 12, t: 34, b: 42 },
        hovermode: "x unified",
        xaxis: { title: { text: `time of the campaign, ${unit.name}` }, anchor: "y2" },
        yaxis: { title: { text: "temperature,<br>°C" }, domain: [0.42, 1] },
        yaxis2: { title: { text: "table rate,<br>deg/s" }, domain: [0, 0.34], anchor: "x" },
      },
    };
  };
  const element = figure(
    "Temperatures and rate since this page was opened",
    "Each point is a progress message of the campaign; the plot begins when this tab was opened.",
    draw,
    {
      height: "21rem",
      csv: () => [
        Object.keys(history),
        ...history.t_s.map((_, k) => Object.values(history).map((values) => values[k])),
      ],
    },
  );
  let next = 0;
  /** @type {ReturnType<typeof setTimeout> | null} */
  let waiting = null;
  /** Redraw at most once a second: a bench in virtual time sends far more messages. */
  const onStatus = () => {
    if (waiting) return;
    waiting = setTimeout(
      () => {
        waiting = null;
        next = Date.now() + MIN_INTERVAL_MS;
        element.redraw();
      },
      Math.max(0, next - Date.now()),
    );
  };
  return Object.assign(element, { onStatus });
}
