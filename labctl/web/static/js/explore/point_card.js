// From a point to the bytes: the readings of one data set, its numbers, and the same computed again from the readings.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { copyText } from "../core/copy_text.js";
import { count, number } from "../core/format.js";
import { button, factList, loadInto, notice } from "../core/components.js";
import { pointCell } from "./notebook_cell.js";

/** @import { Point, Samples } from "../../../types/api.js" */
/** @import { ExploreState } from "./state.js" */

/** @typedef {{ recording: number, dataset: number }} Place */

const MAX_READINGS = 20_000;
/** Significant digits of what is added up in the formula. */
const DIGITS = 9;

/**
 * @param {ExploreState} state
 * @param {Place} place
 */
export function pointCard(state, place) {
  const element = h("section", { class: "stack notice", "aria-label": `Point: data set ${place.dataset}` });
  const { serial, version, recordings, axis } = state;
  loadInto(element, "Reading", async () => {
    const point = await get("/api/units/{serial}/calibrations/{version}/point", {
      path: { serial, version },
      query: { ...place, axis, recordings },
    });
    const samples = point.readings
      ? await get("/api/recordings/{recording}/samples", {
          path: { recording: place.recording },
          query: { dataset: place.dataset, limit: MAX_READINGS },
        })
      : null;
    return [
      h("h3", {}, `Data set ${place.dataset} of recording ${place.recording}, axis ${axis}`),
      h("p", { class: "formula" }, point.formula),
      notice(point.equal === null ? "" : point.equal ? "good" : "bad", point.summary),
      facts(point),
      samples ? readingsFigure(place, axis, samples, point.shown.output_dps) : null,
      h(
        "div",
        { class: "row" },
        button("Copy link", () => copyText(location.href, "Link to this point"), { kind: "tiny" }),
        button("Copy notebook cell", () => copyText(pointCell(state, place, location.origin), "Notebook cell"), {
          kind: "tiny",
        }),
        h(
          "a",
          { class: "button tiny", href: `/recordings/${place.recording}?dataset=${place.dataset}` },
          "Open in its recording",
        ),
      ),
    ];
  });
  return element;
}

/** @param {Point} point */
const facts = (point) =>
  factList([
    ["Mean output", number(point.shown.output_dps, DIGITS), "deg/s", spread(point)],
    ["Rate along the axis", number(point.shown.own_rate_dps, DIGITS), "deg/s"],
    ["Error of the model", number(point.shown.modelled_error_dps, DIGITS), "deg/s"],
    ["Residual", number(point.shown.residual_dps, DIGITS), "deg/s"],
    [
      "Readings",
      point.readings ? count(point.readings) : "–", // a mean of the recording has none
      "",
      point.invalid ? `${count(point.invalid)} more are marked as invalid and do not count` : null,
    ],
    point.readings_sha256
      ? ["SHA-256 of these readings", h("code", { class: "small digest" }, point.readings_sha256), ""]
      : null,
  ]);

/** @param {Point} point */
const spread = (point) => (point.std_dps === null ? null : `readings have s = ${number(point.std_dps, 3)} deg/s`);

/**
 * @param {Place} place
 * @param {string} axis
 * @param {Samples} samples
 * @param {number} mean
 */
function readingsFigure({ recording, dataset }, axis, { columns, readings }, mean) {
  const output = columns[`gyro_${axis}`];
  const t = columns.t_s?.map((value) => value - columns.t_s[0]) ?? output.map((_, k) => k);
  const ends = [t[0], t[t.length - 1]];
  return figure(
    `Readings of recording ${recording} data set ${dataset}`,
    `${output.length < readings ? `The first ${count(output.length)} of ${count(readings)}` : `All ${count(readings)}`} readings of the output about ${axis}. Dashed: their mean, as it is in the residual.`,
    () => ({
      data: [
        {
          type: "scatter",
          mode: output.length < 400 ? "lines+markers" : "lines",
          name: "reading",
          x: t,
          y: output,
          line: { color: colour(`axis-${axis}`), width: 0.8 },
          marker: { size: 4 },
        },
        {
          type: "scatter",
          mode: "lines",
          name: "mean",
          x: ends,
          y: [mean, mean],
          line: { color: colour("text"), width: 1.5, dash: "dash" },
        },
      ],
      layout: {
        showlegend: false,
        xaxis: { title: { text: columns.t_s ? "time since its first reading, s" : "reading" } },
        yaxis: { title: { text: `output about ${axis}, deg/s` } },
        margin: { l: 76, r: 12, t: 8, b: 46 },
      },
    }),
    { height: "14rem" },
  );
}
