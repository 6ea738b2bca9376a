// Live output of the units: the latest value of each axis, and its history since this tab was opened.

import { setChildren, h } from "../core/elements.js";
import { axisColour, figure } from "../core/figure.js";
import { mean, scatterText } from "../core/format.js";
import { campaignTimeUnit } from "../core/time_unit.js";
import { factList, cardWithHeader } from "../core/components.js";

/** @import { Campaign, Output } from "../../../types/api.js" */

const MAX_POINTS = 3000;
/** Up to this many points have markers: a line alone shows nothing of a single point. */
const MARKER_LIMIT = 30;
const DASHES = ["solid", "dash", "dot", "dashdot"];
/** @typedef {Omit<Output, "t_s" | "mean"> & { t_s: number[], mean: number[] }} Course */
/** @typedef {Map<string, Course>} Courses */

/** @type {Map<number, Courses>} */
const seriesByCampaign = new Map();

/**
 * The series of a campaign, one for each unit and axis; kept when the page is left.
 * @param {number} campaign
 * @returns {Courses}
 */
function campaignSeries(campaign) {
  const found = seriesByCampaign.get(campaign) ?? new Map();
  seriesByCampaign.set(campaign, found);
  return found;
}

/** @param {{ channel: string }} output */
const axisName = (output) => output.channel.slice("gyro_".length);
/**
 * @param {{ gyro: string, channel: string }} output
 * @param {boolean} several
 */
const seriesName = (output, several) =>
  several ? `${output.gyro}, axis ${axisName(output)}` : `axis ${axisName(output)}`;

/**
 * A card with `onStatus(status)`: shows the outputs of each progress message.
 * @param {number} campaign
 */
export function liveOutput(campaign) {
  const courses = campaignSeries(campaign);
  const figures = h(
    "div",
    { class: "live-values", "aria-live": "off" },
    h("p", { class: "muted" }, "No readings yet: the units are switched off, or have not sent a reading."),
  );
  const place = h("div", {});
  const units = () => [...new Set([...courses.values()].map((course) => course.gyro))];
  const picture = figure(
    "Gyro output now",
    "Each point is the mean of a unit's latest readings; the first was read when this tab was opened.",
    () => {
      const drawn = [...courses.values()];
      const several = units().length > 1;
      const unit = campaignTimeUnit(drawn[0]?.t_s ?? []);
      return {
        data: drawn.map((course) => ({
          type: "scatter",
          mode: course.t_s.length < MARKER_LIMIT ? "lines+markers" : "lines",
          name: seriesName(course, several),
          x: course.t_s.map((t) => t / unit.seconds),
          y: course.mean,
          marker: { size: 5 },
          line: {
            width: 1.4,
            color: axisColour(axisName(course)),
            dash: DASHES[units().indexOf(course.gyro) % DASHES.length],
          },
          hovertemplate: `%{y:.6~g} ${course.unit}<extra>${seriesName(course, several)}</extra>`,
        })),
        layout: {
          margin: { l: 62, r: 12, t: 30, b: 42 },
          hovermode: "x unified",
          showlegend: drawn.length > 1,
          xaxis: { title: { text: `time of the campaign, ${unit.name}` } },
          yaxis: { title: { text: `output, ${drawn[0]?.unit ?? ""}` } },
        },
      };
    },
    {
      height: "15rem",
      csv: () => [
        ["unit", "channel", "t_s", "mean", "in"],
        ...[...courses.values()].flatMap((course) =>
          course.t_s.map((t, k) => [course.gyro, course.channel, t, course.mean[k], course.unit]),
        ),
      ],
    },
  );

  /** @param {Campaign} status */
  function onStatus(status) {
    const outputs = status.outputs;
    for (const output of outputs) appendOutput(courses, output);
    if (!outputs.length) return;
    const several = new Set(outputs.map((output) => output.gyro)).size > 1;
    setChildren(
      figures,
      factList(
        outputs.map((output) => [
          seriesName(output, several),
          mean(output.mean, output.n > 1 ? output.std : null),
          output.unit,
          output.n > 1 ? `${scatterText(output.std)} over ${output.n} readings` : "one reading",
        ]),
      ),
    );
    if (!picture.isConnected) setChildren(place, picture);
    picture.redraw();
  }
  return Object.assign(cardWithHeader("Gyro output now", null, figures, place), { onStatus });
}

/**
 * @param {Courses} courses
 * @param {Output} output
 */
function appendOutput(courses, output) {
  const key = `${output.gyro} ${output.channel}`;
  const course = courses.get(key) ?? { ...output, t_s: [], mean: [] };
  courses.set(key, course);
  if (output.t_s <= (course.t_s.at(-1) ?? -Infinity)) return;
  course.t_s.push(output.t_s);
  course.mean.push(output.mean);
  for (const values of [course.t_s, course.mean]) values.splice(0, values.length - MAX_POINTS);
}
