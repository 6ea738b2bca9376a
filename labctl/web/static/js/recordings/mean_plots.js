// Plots of a recording without times: mean output over table rate, and temperature in the order of measurement.

import { h } from "../core/elements.js";
import { temperatureColours } from "../core/colour_scales.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { plainNumber } from "../core/format.js";
import { card } from "../core/components.js";
import { channelUnit } from "./channels.js";

/** @import { Picture, RecordingState } from "../../../types/pages.js" */

/**
 * `state` has {id, sets, output, dataset, pick(number)}. A click on a point selects its data set.
 * @param {RecordingState} state
 */
export function meanPlots(state) {
  const { sets, output } = state;
  const gyros = Object.keys(sets.channels).filter((name) => name.startsWith("gyro_"));
  const warm = sets.channels.temperature_c?.mean;
  const coloraxis = warm ? temperatureColours(warm.filter((value) => value !== null)).axis : undefined;
  const tips = sets.number.map(
    (number, k) =>
      `data set ${number}: ${plainNumber(sets.table_rate_dps[k], 6)} deg/s${warm ? ` at ${plainNumber(warm[k])} °C` : ""}, ${sets.position[k]} up`,
  );
  /** @param {number} k */
  const spot = (k) => (sets.number[k] === state.dataset ? 13 : 5);
  const rim = () => ({
    width: sets.number.map((number) => (number === state.dataset ? 2.5 : 0)),
    color: colour("text"),
  });
  /** @returns {Picture} */
  const drawRate = () => ({
    data: gyros.map((name) => ({
      type: "scatter",
      mode: "markers",
      name: `axis ${name.slice(5)}`,
      x: sets.table_rate_dps,
      y: sets.channels[name].mean,
      customdata: sets.number,
      text: tips,
      hovertemplate: `%{y:.6~g} ${channelUnit(name, output)}<br>%{text}<extra></extra>`,
      marker: {
        size: sets.number.map((_, k) => spot(k)),
        line: rim(),
        ...(warm ? { color: warm, coloraxis: "coloraxis" } : { color: axisColour(name.slice(5)) }),
      },
    })),
    layout: {
      coloraxis,
      showlegend: false,
      margin: { l: 66, r: 12, t: 8, b: 46 },
      xaxis: { title: { text: "table rate, deg/s" } },
      yaxis: { title: { text: `output, ${channelUnit(gyros[0], output)}` } },
    },
  });
  /** @returns {Picture} */
  const drawWarm = () => ({
    data: [
      {
        type: "scatter",
        mode: "lines+markers",
        name: "gyro temperature",
        x: sets.number,
        y: warm,
        customdata: sets.number,
        text: tips,
        hovertemplate: "%{text}<extra></extra>",
        line: { color: colour("accent"), width: 1 },
        marker: { size: sets.number.map((_, k) => spot(k) - 2), line: rim(), color: colour("accent") },
      },
    ],
    layout: {
      showlegend: false,
      margin: { l: 58, r: 12, t: 8, b: 46 },
      xaxis: { title: { text: "data set" } },
      yaxis: { title: { text: "gyro temperature, °C" } },
    },
  });
  const pictures = [
    figure(
      `Recording ${state.id} output over rate`,
      "One point for each data set; its colour is the gyro's temperature.",
      drawRate,
      { height: "19rem" },
    ),
    warm
      ? figure(
          `Recording ${state.id} temperature`,
          "In the order of the data sets. Click a point to select its data set.",
          drawWarm,
          { height: "19rem" },
        )
      : null,
  ].filter((each) => each !== null);
  for (const picture of pictures)
    picture.ondrawn = (plot) => plot.on("plotly_click", (event) => state.pick(event.points[0].customdata));
  return Object.assign(card("Means", h("div", { class: "columns" }, pictures)), {
    redraw: () => pictures.forEach((picture) => picture.redraw()),
  });
}
