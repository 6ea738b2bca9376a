// Control chart of a coefficient over time by batch, bench or supplier; a brush over it lists the groups inside.

import { cardWithHeader, table } from "../core/components.js";
import { h, setChildren } from "../core/elements.js";
import { labelledField, selectField } from "../core/fields.js";
import { colour, figure } from "../core/figure.js";
import { capitalised, count, idText, withUnit } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";
import { get } from "../core/http/api.js";
import { brushed } from "./brushed.js";

/** @import { FleetChart } from "../../../types/api.js" */
/** @import { Picture } from "../../../types/pages.js" */

/** @type {readonly (readonly [string, string])[]} */
const FACTORS = [
  ["batch", "batch"],
  ["bench", "bench"],
  ["supplier", "supplier"],
];
const SYMBOLS = ["circle", "square", "diamond", "cross", "x", "triangle-up", "triangle-down", "star"];

/**
 * The card; it loads the chart that is chosen in it.
 * @param {string} type
 * @param {AbortSignal} signal
 */
export async function chartCard(type, signal) {
  const body = h("div", { class: "stack" });
  const choices = h("div", { class: "row" });
  let choice = { axis: "", name: "", factor: "batch" };
  /** @param {Partial<typeof choice>} changed */
  const load = async (changed) => {
    choice = { ...choice, ...changed };
    const chart = await get("/api/fleet/chart", { query: { type, ...choice }, signal });
    setChildren(body, ...drawn(chart));
    if (!chart.coefficients.length) return; // there is nothing to choose from
    setChildren(
      choices,
      selectField(
        "Coefficient",
        chart.coefficients.map((each) => [`${each.axis} ${each.name}`, `${each.axis} ${each.name}`]),
        `${chart.axis} ${chart.name}`,
        (value) => {
          const [axis, ...name] = value.split(" ");
          return load({ axis, name: name.join(" ") });
        },
      ),
      selectField("Grouped by", FACTORS, choice.factor, (factor) => load({ factor })),
    );
  };
  await load({});
  return cardWithHeader("Control chart", choices, body);
}

/** @param {FleetChart} chart */
function drawn(chart) {
  if (!chart.points.length)
    return [
      h("p", { class: "muted" }, "No fleet job has fitted units of this type that were measured on a known day."),
    ];
  const from = h("input", { type: "date" });
  const to = h("input", { type: "date" });
  const found = h("div");
  const list = () => setChildren(found, groupTable(chart, brushed(chart.points, from.value, to.value)));
  for (const input of [from, to]) input.addEventListener("change", list);
  list();
  const picture = figure(
    `${chart.axis} ${chart.name} over time`,
    "Each point is the mean of the units of one group that were measured in one span of time; the bar is from the least to the largest value. Draw a box over the chart, or give two days, to list the groups inside.",
    () => pictureOf(chart),
    { height: "20rem" },
  );
  picture.ondrawn = (plot) =>
    plot.on("plotly_selected", (event) => {
      const days = (event?.points ?? []).map(({ x }) => String(x).slice(0, 10)).sort();
      if (!days.length) return;
      [from.value, to.value] = [days[0], days[days.length - 1]];
      list();
    });
  return [picture, h("div", { class: "row" }, labelledField("From", from), labelledField("To", to)), found];
}

/**
 * @param {FleetChart} chart
 * @returns {Picture}
 */
function pictureOf(chart) {
  const [factor, unit] = shownUnit(chart.unit, chart.name);
  const levels = [...new Set(chart.points.map(({ level }) => level))];
  const colours = ["axis-x", "axis-y", "axis-z", "accent", "bad", "warn"].map(colour);
  return {
    data: levels.map((level, k) => {
      const own = chart.points.filter((point) => point.level === level);
      return {
        type: "scatter",
        mode: "markers",
        name: level || "not stated",
        x: own.map(({ at }) => at),
        y: own.map(({ mean }) => factor * mean),
        customdata: own.map(({ units }) => units),
        error_y: {
          type: "data",
          symmetric: false,
          array: own.map(({ high, mean }) => factor * (high - mean)),
          arrayminus: own.map(({ low, mean }) => factor * (mean - low)),
          thickness: 1,
          width: 0,
        },
        marker: { size: 8, color: colours[k % colours.length], symbol: SYMBOLS[k % SYMBOLS.length] },
        hovertemplate: `%{x|%d %b %Y}: %{y:.4g} ${unit}<br>%{customdata} units<extra>${level || "not stated"}</extra>`,
      };
    }),
    layout: {
      dragmode: "select",
      xaxis: { type: "date" },
      yaxis: { title: { text: [idText(chart.name), unit].filter(Boolean).join(", ") } },
      showlegend: levels.length > 1 && levels.length <= 12,
    },
  };
}

/**
 * @param {FleetChart} chart
 * @param {ReturnType<typeof brushed>} groups
 */
function groupTable(chart, groups) {
  const [factor, unit] = shownUnit(chart.unit, chart.name);
  return table(
    [
      { title: capitalised(chart.factor), cell: ({ level }) => level || "not stated" },
      { title: "Units", number: true, cell: ({ units }) => count(units) },
      { title: "Mean", number: true, cell: ({ mean }) => withUnit(factor * mean, unit, 4) },
      {
        title: "Beside all others",
        number: true,
        cell: ({ off }) => withUnit(off === null ? null : factor * off, unit, 2),
      },
    ],
    groups.slice(0, 50),
    { label: "Groups in the chosen time" },
  );
}
