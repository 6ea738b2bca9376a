// The live calibration that runs: the pose that is needed, how long the unit rests, and how U falls.

import { get, post } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { count, duration, plainNumber, resultTexts } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";
import { axisColour, figure } from "../core/figure.js";
import { actButton, card, chip, table } from "../core/components.js";
import { poseDrawing } from "./pose_drawing.js";
import { offText, sharesOfLimits, stillText, unusedTexts } from "./texts.js";

/** @import { LiveHistory, LiveMoment, LiveState } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */

const DASHES = ["solid", "dash", "dot", "dashdot", "longdash"];

/** @param {{ unit: string, name: string }} row */
const factorOf = ({ unit, name }) => shownUnit(unit, name)[0];

/**
 * A coefficient and its U as texts of the same place.
 * @param {LiveMoment["coefficients"][number]} row
 */
function resultOf({ value, expanded, unit, name }) {
  const { middle, half, power } = resultTexts(value, expanded, unit, name);
  return [middle, half ?? "–"].map((text) => [text, power].filter(Boolean).join(" "));
}

/**
 * The coefficients with U and limit.
 * @param {readonly LiveMoment["coefficients"][number][]} coefficients
 */
export const coefficientTable = (coefficients) =>
  table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "Coefficient", cell: (row) => h("code", {}, row.name) },
      { title: "Value", number: true, cell: (row) => resultOf(row)[0] },
      {
        title: "U, k = 2",
        number: true,
        cell: (row) => h("span", { "data-u": row.expanded }, resultOf(row)[1]),
      },
      {
        title: "Limit",
        number: true,
        cell: (row) => (row.limit === null ? "none" : plainNumber(factorOf(row) * row.limit)),
      },
      { title: "Unit", cell: (row) => shownUnit(row.unit, row.name)[1] },
      {
        title: "Goal",
        cell: (row) =>
          row.limit === null ? "" : row.expanded <= row.limit ? chip("reached", "good") : chip("not yet", "warn"),
      },
    ],
    coefficients,
    { dense: true, label: "Coefficients" },
  );

/**
 * U of every limited coefficient over time, as shares of their limits.
 * @param {() => LiveHistory} history
 */
function fallingPlot(history) {
  return figure(
    "Uncertainty against its limit",
    "U (k = 2) of each coefficient that the target limits, divided by its limit, at every fit; 1 is the goal. Coefficients without a limit are in the table only.",
    () => ({
      data: sharesOfLimits(history()).map((line, k) => ({
        type: "scatter",
        mode: "lines+markers",
        x: line.t_s,
        y: line.share,
        name: `${line.name} of ${line.axis}`,
        line: { color: axisColour(line.axis), dash: DASHES[k % DASHES.length] },
        marker: { size: 5 },
      })),
      layout: {
        xaxis: { title: { text: "time, s" } },
        yaxis: { title: { text: "U / limit" }, type: "log" },
        legend: { orientation: "h", y: -0.22, yanchor: "top", x: 0 },
        shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: 1, y1: 1, line: { width: 1.5, dash: "dash" } }],
      },
    }),
    { height: "28rem" },
  );
}

/**
 * @param {string} title
 * @param {readonly string[]} texts
 * @param {string} none
 */
const list = (title, texts, none) => [
  h("h3", {}, title),
  texts.length
    ? h(
        "ul",
        {},
        texts.map((text) => h("li", {}, text)),
      )
    : h("p", { class: "muted" }, none),
];

/**
 * The cards of a calibration that runs, and `update(state)`.
 * @param {LiveState} first
 * @param {AbortSignal} signal
 */
export function runningLive(first, signal) {
  const asked = h("div", { class: "live-picture" });
  const now = h("div", { class: "live-picture" });
  const bar = h("i", {});
  const still = h("p", { class: "lead live-line", "aria-label": "Rest" });
  const off = h("p", { class: "muted live-line" });
  const request = h("p", { class: "lead live-request", role: "status", "aria-label": "What is needed now" });
  const summary = h("p", { class: "muted live-line" });
  const poses = h("ul", { class: "live-poses", "aria-label": "Poses" });
  const figures = h("div", { class: "live-figures" });
  const trouble = h("div", { class: "live-trouble" });
  /** @type {LiveHistory} */
  let history = { number: 0, t_s: [], poses: [], coefficients: [] };
  const plot = fallingPlot(() => history);
  let [fits, shown, drawn] = [-1, "", ""];

  /** @param {boolean} fit */
  const end = (fit) => post("/api/live/end", { body: { fit } });

  /** @param {LiveMoment} moment */
  async function refit(moment) {
    setChildren(
      figures,
      moment.coefficients.length
        ? coefficientTable(moment.coefficients)
        : h("p", { class: "muted" }, "No fit yet: the accelerometer takes 12 poses."),
    );
    history = await get("/api/live/history", { signal });
    plot.update();
  }

  /** @param {LiveState} state */
  function update(state) {
    const { moment, target } = state;
    setChildren(request, state.text);
    if (!moment || !target) return;
    const need = moment.request?.name ?? "";
    if (need !== shown)
      setChildren(asked, moment.request ? poseDrawing(moment.request.up, moment.request.text, need) : null);
    shown = need;
    const at = moment.up?.map((v) => v.toFixed(2)).join() ?? "";
    if (at !== drawn) setChildren(now, moment.up ? poseDrawing(moment.up, "The pose of the unit now") : null);
    drawn = at;
    still.textContent = stillText(moment, target.rest_s);
    bar.style.width = `${Math.min(100, (100 * moment.still_s) / target.rest_s)}%`;
    off.textContent = offText(moment);
    const left = moment.turns_left ? `, about ${moment.turns_left} more turns` : "";
    summary.textContent = `${duration(moment.duration_s)}: ${count(moment.readings)} readings, ${moment.rests} rests, ${moment.poses.length} of ${moment.poses_asked} poses${left}`;
    setChildren(
      poses,
      moment.pose_list.map((each) =>
        h(
          "li",
          { title: each.text, "aria-current": each.name === need ? "step" : null },
          chip([each.covered ? "✓ " : "", each.name], each.covered ? "good" : each.name === need ? "accent" : ""),
        ),
      ),
    );
    setChildren(
      trouble,
      ...list("Still missing", moment.missing, "Nothing."),
      ...list("Not used", unusedTexts(moment), "All readings and turns are used."),
    );
    if (moment.fits !== fits) {
      fits = moment.fits;
      refit(moment).catch(() => (fits = -1)); // it is tried again with the next state
    }
  }

  /** @type {Child} */
  const ends = h(
    "div",
    { class: "row" },
    actButton("End and keep the recording", () => end(false)),
    actButton("End and fit a version", () => end(true)),
  );
  const element = h(
    "div",
    { class: "stack" },
    card(
      "Pose that is needed now",
      request,
      h(
        "div",
        { class: "live-pictures" },
        h("figure", {}, asked, h("figcaption", {}, "needed")),
        h("figure", {}, now, h("figcaption", {}, "now, by the accelerometer; its heading is not known")),
      ),
      still,
      h("div", { class: "meter thick" }, bar),
      off,
      summary,
      ends,
    ),
    card("Poses", poses),
    card("Uncertainty", plot, figures),
    card("What is missing, and what cannot be used", trouble),
  );
  update(first);
  return { element, update };
}
