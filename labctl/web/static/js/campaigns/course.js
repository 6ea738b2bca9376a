// The course of a campaign: a slider moves through it, and chamber, units, output and data set move together.

import { colour, figure } from "../core/figure.js";
import { factList } from "../core/components.js";
import { setChildren, h } from "../core/elements.js";
import { duration, plainNumber } from "../core/format.js";
import { timeUnit } from "../core/time_unit.js";
import { channelUnit } from "../recordings/channels.js";
import { indexAt, readingsAt, soakCourse, soaksOf } from "./course_numbers.js";

/** @import { CampaignPlan, Course } from "../../../types/api.js" */
/** @import { MeasuredSets } from "./course_numbers.js" */

const HOURS_FROM_S = 10_800;
const DASHES = ["solid", "dash"];

/**
 * @param {Course} course
 * @param {CampaignPlan} plan
 * @param {MeasuredSets | null} datasets of the first recording
 * @param {(t_s: number) => void} moved called with the time, s, that the slider is at
 */
export function courseCard(course, plan, datasets, moved) {
  if (course.t_s.length < 2) return null;
  const all = { course, steps: plan.timeline, datasets };
  const [begin, end] = [course.t_s[0], course.t_s[course.t_s.length - 1]];
  const unit = timeUnit(end - begin, HOURS_FROM_S);
  let at_s = begin;
  const readings = h("div", { "aria-live": "polite" });
  const shown = course.t_s.length;
  const caption =
    `Temperatures as they were logged: ${shown < course.samples ? `${shown} of ${course.samples} times, the lowest and highest of each span` : `all ${shown} times`}.` +
    (datasets ? ` Below: the mean output of each data set of recording ${datasets.recording}.` : "");
  const picture = figure("Course of the campaign", caption, draw, { height: "22rem" });
  const slider = /** @type {HTMLInputElement} */ (
    h("input", {
      type: "range",
      min: "0",
      max: String(shown - 1),
      value: "0",
      class: "course-slider",
      "aria-label": "Time of the campaign",
      oninput: () => move(course.t_s[Number(slider.value)]),
    })
  );
  picture.ondrawn = (plot) =>
    plot.on("plotly_click", (event) => {
      const t_s = Number(event.points[0].x) * unit.seconds;
      slider.value = String(indexAt(course.t_s, t_s));
      move(t_s);
    });

  function draw() {
    const x = course.t_s.map((t) => t / unit.seconds);
    /**
     * @param {string} name
     * @param {readonly (number | null)[]} y
     * @param {string} shade
     * @param {object} [line]
     */
    const warm = (name, y, shade, line = {}) => ({
      type: "scatter",
      mode: "lines",
      name,
      x,
      y,
      line: { color: colour(shade), width: 1.6, ...line },
      hovertemplate: `%{y:.2f} °C<extra>${name}</extra>`,
    });
    return {
      data: [
        warm("set point", course.setpoint_c, "border-strong", { dash: "dot", shape: "hv" }),
        warm("chamber", course.chamber_c, "axis-x"),
        ...Object.entries(course.units_c).map(([serial, values], k) => warm(serial, values, k ? "axis-z" : "axis-y")),
        ...outputs(plan, datasets, unit.seconds),
      ],
      layout: {
        margin: { l: 76, r: 12, t: 34, b: 42 },
        xaxis: { title: { text: `time of the campaign, ${unit.name}` }, anchor: datasets ? "y2" : "y" },
        yaxis: { title: { text: "temperature,<br>°C" }, domain: datasets ? [0.42, 1] : [0, 1] },
        ...(datasets ? { yaxis2: { title: { text: outputTitle(datasets) }, domain: [0, 0.34], anchor: "x" } } : {}),
        shapes: [
          {
            type: "line",
            xref: "x",
            yref: "paper",
            x0: at_s / unit.seconds,
            x1: at_s / unit.seconds,
            y0: 0,
            y1: 1,
            line: { color: colour("text"), width: 1.6 },
          },
        ],
      },
    };
  }
  /** @param {number} t_s */
  function move(t_s) {
    at_s = t_s;
    slider.setAttribute("aria-valuetext", duration(t_s));
    setChildren(readings, factList(readingsAt(all, t_s)));
    picture.redraw();
    moved(t_s);
  }
  setChildren(readings, factList(readingsAt(all, at_s)));
  return h(
    "section",
    { class: "card stack", "aria-label": "Course" },
    h(
      "div",
      { class: "row space-between" },
      h("h2", {}, "Course"),
      h("a", { class: "button tiny", href: `/campaigns/${course.campaign}/channels` }, "Choose channels"),
    ),
    picture,
    slider,
    readings,
    twoSoaks(course, plan),
  );
}

/**
 * The title of the axis of the outputs, with the unit that they share.
 * @param {MeasuredSets} datasets
 */
function outputTitle(datasets) {
  const names = Object.keys(datasets.channels).filter((name) => name.startsWith("gyro_"));
  return ["output", ...new Set(names.map((name) => channelUnit(name, datasets.output)))].join(",<br>");
}

/**
 * The mean output of each data set, at the middle of its step.
 * @param {CampaignPlan} plan
 * @param {MeasuredSets | null} datasets
 * @param {number} unit_s
 */
function outputs({ timeline }, datasets, unit_s) {
  if (!datasets) return [];
  const steps = new Map(timeline.dataset.flatMap((dataset, k) => (dataset === null ? [] : [[dataset, k]])));
  const middle = datasets.number.map((number) => {
    const k = steps.get(number);
    const [from, until] = k === undefined ? [null, null] : [timeline.started_s[k], timeline.ended_s[k]];
    return from === null || until === null ? null : (from + until) / 2 / unit_s;
  });
  return Object.entries(datasets.channels)
    .filter(([name]) => name.startsWith("gyro_"))
    .map(([name, channel]) => ({
      type: "scatter",
      mode: "markers",
      name: `output ${name.replace("gyro_", "")}`,
      x: middle,
      y: channel.mean,
      yaxis: "y2",
      marker: { size: 5, color: colour(`axis-${name.replace("gyro_", "")}`) || colour("accent") },
      text: datasets.number.map((number) => `data set ${number}`),
      hovertemplate: `%{y:.7~g} ${channelUnit(name, datasets.output)}<extra>%{text}</extra>`,
    }));
}

/**
 * Two soaks over each other, each against its own beginning and set point; null where there are not two.
 * @param {Course} course
 * @param {CampaignPlan} plan
 */
function twoSoaks(course, plan) {
  const soaks = soaksOf(plan.timeline);
  if (soaks.length < 2) return null;
  const chosen = [0, soaks.length - 1];
  /** @param {number} k */
  const name = (k) => `soak of step ${soaks[k].number} at ${plainNumber(soaks[k].temperature_c ?? NaN)} °C`;
  const draw = () => ({
    data: chosen.flatMap((k, which) =>
      [
        ["chamber", course.chamber_c, "axis-x"],
        ...Object.entries(course.units_c).map(([serial, y]) => [serial, y, "axis-y"]),
      ].map(([what, values, shade]) => ({
        type: "scatter",
        mode: "lines",
        name: `${what}, ${name(k)}`,
        ...soakCourse(course, /** @type {(number | null)[]} */ (values), soaks[k]),
        line: { color: colour(String(shade)), width: 1.6, dash: DASHES[which] },
        hovertemplate: "%{y:.3f} K after %{x:.1f} min<extra>%{fullData.name}</extra>",
      })),
    ),
    layout: {
      margin: { l: 62, r: 12, t: 44, b: 42 },
      xaxis: { title: { text: "time since the soak began, min" } },
      yaxis: { title: { text: "temperature less set point, K" } },
    },
  });
  const picture = figure(
    "Two soaks over each other",
    "Temperatures of two soaks less their set points, each from its own beginning; the second is dashed.",
    draw,
    { height: "17rem" },
  );
  /** @param {number} which */
  const choice = (which) =>
    h(
      "label",
      { class: "field" },
      which ? "Second soak" : "First soak",
      h(
        "select",
        {
          /** @param {Event} event */
          onchange: (event) => {
            chosen[which] = Number(/** @type {HTMLSelectElement} */ (event.target).value);
            picture.redraw();
          },
        },
        soaks.map((_, k) => h("option", { value: String(k), selected: k === chosen[which] }, name(k))),
      ),
    );
  return h(
    "details",
    {},
    h("summary", {}, "Two soaks over each other"),
    h("div", { class: "row" }, choice(0), choice(1)),
    picture,
  );
}
