// Live output of the units: the latest value of each axis, and its history since this tab was opened.

import { setChildren, h } from "../core/elements.js";
import { axisColour, figure } from "../core/figure.js";
import { mean, number } from "../core/format.js";
import { factList, cardWithHeader } from "../core/components.js";

const MAX_POINTS = 3000;
/** Up to this many points have markers: a line alone shows nothing of a single point. */
const MARKER_LIMIT = 30;
const DASHES = ["solid", "dash", "dot", "dashdot"];
const seriesByCampaign = new Map();

/** The series of a campaign, one for each unit and axis; kept when the page is left. */
function campaignSeries(campaign) {
  if (!seriesByCampaign.has(campaign)) seriesByCampaign.set(campaign, new Map());
  return seriesByCampaign.get(campaign);
}

const axisName = (output) => output.channel.slice("gyro_".length);
const seriesName = (output, several) =>
  several ? `${output.gyro}, axis ${axisName(output)}` : `axis ${axisName(output)}`;

/** A card with `onStatus(status)`: shows the outputs of each progress message. */
export function liveOutput(campaign) {
  const courses = campaignSeries(campaign);
  const figures = h(
    "div",
    { class: "live-values", "aria-live": "off" },
    h("p", { class: "muted" }, "The units are off, or have not been heard yet."),
  );
  const place = h("div", {});
  const units = () => [...new Set([...courses.values()].map((course) => course.gyro))];
  const picture = figure(
    "Gyro output now",
    "Means of what each unit sent last, since this tab began to listen.",
    () => {
      const drawn = [...courses.values()];
      const several = units().length > 1;
      return {
        data: drawn.map((course) => ({
          type: "scatter",
          mode: course.t_s.length < MARKER_LIMIT ? "lines+markers" : "lines",
          name: seriesName(course, several),
          x: course.t_s,
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
          xaxis: { title: { text: "time of the campaign, s" } },
          yaxis: { title: { text: drawn[0]?.unit ?? "" } },
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

  function onStatus(status) {
    const outputs = status.outputs ?? [];
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
          output.n > 1 ? `± ${number(output.std, 2)} over ${output.n} readings` : "one reading",
        ]),
      ),
    );
    if (!picture.isConnected) setChildren(place, picture);
    picture.redraw();
  }
  return Object.assign(cardWithHeader("Gyro output now", null, figures, place), { onStatus });
}

function appendOutput(courses, output) {
  const key = `${output.gyro} ${output.channel}`;
  if (!courses.has(key)) courses.set(key, { ...output, t_s: [], mean: [] });
  const course = courses.get(key);
  if (course.t_s.length && output.t_s <= course.t_s.at(-1)) return;
  for (const name of ["t_s", "mean"]) {
    course[name].push(output[name]);
    if (course[name].length > MAX_POINTS) course[name].splice(0, course[name].length - MAX_POINTS);
  }
}
