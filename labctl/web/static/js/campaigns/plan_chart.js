// Chart of a plan: temperature over time with its data sets, their rates below, positions as bands.

import { colour, figure } from "../core/figure.js";
import { duration, isNumber, plainNumber } from "../core/format.js";
import { axisOf } from "../core/positions.js";
import { planSteps, positionBands, setPointCourse } from "./plan_steps.js";

/** @import { Timeline } from "../../../types/api.js" */
/** @import { PlotTrace } from "../../../types/pages.js" */

/**
 * States of a data set and their colours, in the order of the legend.
 * @type {[state: string, colour: string][]}
 */
const STATES = [
  ["done", "good"],
  ["running", "accent"],
  ["to come", "border-strong"],
  ["failed", "bad"],
  ["interrupted", "bad"],
  ["skipped", "text-muted"],
];
/** Plans longer than this are drawn in hours, shorter ones in minutes, s. */
const HOURS_FROM_S = 3 * 3600;

/** Half the height of a mark at the set point, as a share of the temperatures of the plan. */
const TICK_SHARE = 0.03;

/**
 * The colour of the axis that points up; of a tilted unit that of plain text.
 * @param {string} position
 */
const bandColour = (position) => (axisOf(position) ? `axis-${axisOf(position)}` : "text-muted");

/**
 * The chart of a plan. `give()` returns {timeline, now_s, live}: the columns of the API, the present moment in seconds of
 * the campaign (null: it does not run; `scrubbed`: one that was chosen), and whether to show states. `pick(dataset)` is called for a clicked data set.
 * @param {string} name
 * @param {() => { timeline: Timeline, now_s?: number | null, scrubbed?: boolean, live?: boolean }} give
 * @param {{ height?: string, pick?: (dataset: number) => unknown }} [options]
 */
export function planChart(name, give, { height = "24rem", pick } = {}) {
  const caption =
    "Above: set point of the chamber, with a mark for each data set. Below: the table rate of each data set. Bands: which axis of the unit points up.";
  const draw = () => {
    const { timeline, now_s = null, scrubbed = false, live = false } = give();
    const unit_s = (timeline.start_s.at(-1) ?? 0) + (timeline.expected_s.at(-1) ?? 0) > HOURS_FROM_S ? 3600 : 60;
    const steps = planSteps(timeline, unit_s);
    const sets = steps.filter((step) => step.dataset !== null);
    const byHand = sets.length > 0 && sets.every((step) => step.kind === "turn");
    const warm = sets.map((step) => step.warm).filter(isNumber);
    const tick_c = TICK_SHARE * (Math.max(...warm) - Math.min(...warm) || 2); // of one temperature the axis spans 2 K
    const narrow = window.innerWidth < 760;
    const marks = STATES.flatMap(([state, shade]) => {
      const here = sets.filter((step) => step.state === state);
      if (!here.length) return [];
      const middles = here.map((step) => (step.from + step.until) / 2);
      const texts = here.map(
        (step) =>
          `data set ${step.dataset}: ${byHand ? `${plainNumber(step.turn)} deg by hand` : `${plainNumber(step.rate)} deg/s at ${plainNumber(step.warm)} °C`}, ${step.position ?? "?"} up<br>${live ? `${state}, ` : ""}begins after ${duration(step.from * unit_s)}, takes ${duration((step.until - step.from) * unit_s)}`,
      );
      /** @type {PlotTrace} */
      const common = {
        type: "scatter",
        name: live ? `${state} (${here.length})` : "data sets",
        legendgroup: state,
        hovertemplate: "%{text}<extra></extra>",
      };
      const fill = colour(live ? shade : "accent");
      return [
        {
          ...common, // one line with gaps: a browser draws it at once, but hundreds of markers one by one
          mode: "lines",
          x: here.flatMap((_, k) => [middles[k], middles[k], null]),
          y: here.flatMap(({ warm }) => (isNumber(warm) ? [warm - tick_c, warm + tick_c, null] : [null, null, null])),
          customdata: here.flatMap(({ dataset }) => [dataset, dataset, null]),
          text: texts.flatMap((text) => [text, text, ""]),
          showlegend: live && !byHand,
          line: { color: fill, width: state === "running" ? 4 : 1.6 },
        },
        {
          ...common,
          mode: "markers",
          x: middles,
          y: here.map((step) => (byHand ? step.turn : step.rate)),
          customdata: here.map((step) => step.dataset),
          text: texts,
          yaxis: "y2",
          showlegend: live && byHand,
          selected: { marker: { opacity: 1 } },
          marker: {
            size: sets.length > 200 ? 4 : 5.5,
            color: fill,
            symbol: state === "skipped" ? "circle-open" : "circle",
          },
        },
      ];
    });
    const end = steps.at(-1)?.until ?? 1;
    /** @type {object[]} */
    const shapes = positionBands(steps).map((band) => ({
      type: "rect",
      xref: "x",
      yref: "paper",
      x0: band.from,
      x1: band.until,
      y0: 0,
      y1: 1,
      line: { width: 0 },
      fillcolor: colour(bandColour(band.position)),
      opacity: 0.1,
      layer: "below",
    }));
    /** @type {object[]} */
    const words = positionBands(steps)
      .filter((band) => band.until - band.from > end / (narrow ? 12 : 30))
      .map((band) => ({
        text: `<b>${band.position}</b> up`,
        showarrow: false,
        xref: "x",
        yref: "paper",
        x: (band.from + band.until) / 2,
        y: 1,
        yanchor: "bottom",
        font: { size: 11.5, color: colour(bandColour(band.position)) },
      }));
    if (now_s !== null) {
      shapes.push({
        type: "line",
        xref: "x",
        yref: "paper",
        x0: now_s / unit_s,
        x1: now_s / unit_s,
        y0: 0,
        y1: 1,
        line: { color: colour("text"), width: 1.6, dash: "dot" },
      });
      words.push({
        text: scrubbed ? duration(now_s) : "now",
        showarrow: false,
        xref: "x",
        yref: "paper",
        x: now_s / unit_s,
        y: 0.42,
        yanchor: "middle",
        xanchor: now_s / unit_s > end * 0.9 ? "right" : "left",
        font: { size: 11.5, color: colour("text") },
      });
    }
    return {
      data: [
        {
          type: "scatter",
          mode: "lines",
          name: "set point",
          ...setPointCourse(steps),
          line: { color: colour("text-muted"), width: 1.5 },
          hoverinfo: "skip",
          showlegend: false,
        },
        ...marks,
      ],
      layout: {
        margin: { l: 56, r: 12, t: live ? 44 : 24, b: 42 },
        shapes,
        annotations: words,
        legend: { orientation: "h", y: 1.07, yanchor: "bottom", x: 0 },
        xaxis: {
          title: { text: `time since the beginning, ${unit_s === 3600 ? "h" : "min"}` },
          anchor: "y2",
          range: [-0.01 * end, Math.max(end, (now_s || 0) / unit_s) * 1.01],
        },
        yaxis: byHand ? { visible: false } : { title: { text: "set point, °C" }, domain: [0.46, 1] },
        yaxis2: byHand
          ? { title: { text: "turn, deg" }, domain: [0, 1], anchor: "x" }
          : { title: { text: "rate, deg/s" }, domain: [0, 0.38], anchor: "x" },
      },
    };
  };
  const csv = () => {
    const { timeline } = give();
    const columns = Object.entries(timeline);
    return [columns.map(([each]) => each), ...timeline.number.map((_, k) => columns.map(([, values]) => values[k]))];
  };
  const element = figure(name, caption, draw, { height, csv });
  if (pick)
    element.ondrawn = (plot) =>
      plot.on("plotly_click", (event) => event.points[0].customdata && pick(event.points[0].customdata));
  return element;
}
