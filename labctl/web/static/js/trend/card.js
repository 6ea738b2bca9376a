// A unit over its recordings in time: as found, as left, drift per year, and when the bias leaves its limit.

import { get } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { day, number, sizeText, withUncertainty, inWords } from "../core/format.js";
import { cardWithHeader, chip, loadInto, table } from "../core/components.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { query, updateQuery } from "../core/router.js";
import { pointPlace } from "../core/figure_point.js";
import { driftFigure, errorFigure } from "./figures.js";
import { askedTrend } from "./point.js";

/** @import { CalibrationRow, Drift, Trend } from "../../../types/api.js" */

const K = 2;
/** @type {Record<string, string>} */
const NAMES = { bias: "bias", scale_factor: "scale factor", error: "RMS error" };

/**
 * @param {string} serial
 * @param {readonly CalibrationRow[]} rows
 * @param {AbortSignal} signal
 */
export function trendCard(serial, rows, signal) {
  const place = h("div", { class: "stack" });
  const versions = rows.map((row) => row.version).sort((a, b) => a - b);
  let version = versions.find((each) => each === Number(query().trend)) ?? versions[0];
  let limit = Number(query().limit) > 0 ? Number(query().limit) : null;
  const show = () => {
    updateQuery({ trend: version === versions[0] ? null : version, limit });
    const asked = { version, limit_dps: limit };
    loadInto(place, "Applying the version to every recording", async () => {
      const found = await get("/api/units/{serial}/trend", { path: { serial }, query: asked, signal });
      if (asked.version === version && asked.limit_dps === limit) field.placeholder = number(found.limit_dps);
      return shown(serial, found);
    });
  };
  /** @type {HTMLInputElement} */
  const field = h("input", {
    type: "number",
    min: 0,
    step: "any",
    value: limit,
    style: "width: 9rem",
    onchange: () => {
      limit = Number(field.value) > 0 ? Number(field.value) : null;
      show();
    },
  });
  show();
  const choose = h("div", { class: "row", style: "align-items: end" });
  setChildren(
    choose,
    selectField(
      "Version",
      versions.map((each) => option(each, `version ${each}`)),
      version,
      (value) => {
        version = Number(value);
        show();
      },
    ),
    labelledField("Largest acceptable bias, deg/s", field),
  );
  return cardWithHeader("Over the years", choose, place);
}

/** Why the error of a version on its own recording is larger here than the RMS of its fit. */
const AS_APPLIED =
  "The RMS errors are those of the version applied without refitting: they include what the Earth's rate adds while the " +
  "table turns, and the angles of fixture and table, which a fit estimates beside the model. The RMS error of the fit under " +
  "Calibrations is without them.";

/**
 * @param {string} serial
 * @param {Trend} trend
 */
function shown(serial, trend) {
  const place = pointPlace();
  place.open((key) => askedTrend(serial, trend, key));
  const turned = trend.drifts.some((drift) => drift.what === "scale_factor");
  return [
    trend.text.map((line) => h("p", {}, inWords(line, ["scale_factor"]))),
    trend.drifts.length ? h("p", { class: "muted small" }, AS_APPLIED) : null,
    trend.drifts.length
      ? h(
          "div",
          { class: "columns", style: "--column-min: 19rem" },
          driftFigure(serial, trend, "bias", place),
          turned ? driftFigure(serial, trend, "scale_factor", place) : null,
          errorFigure(serial, trend, place),
        )
      : null,
    place.element,
    drifts(trend),
    pointTable(trend),
  ];
}

/** @param {Trend} trend */
function drifts(trend) {
  if (!trend.drifts.length) return null;
  const leaves = new Map(trend.leaves.map((each) => [each.axis, each]));
  /** @param {Drift} row */
  const when = (row) => {
    const each = leaves.get(row.axis);
    if (row.what !== "bias" || !each) return "–";
    if (each.outside) return chip("outside already", "bad");
    if (row.u !== null && !row.significant)
      return each.earliest ? `not before ${day(each.earliest)} (95 %)` : "not within 50 years";
    if (!each.expected) return "not within 50 years";
    const between = `${day(each.earliest)} to ${each.latest ? day(each.latest) : "not within 50 years"}`;
    return [day(each.expected), each.earliest ? h("div", { class: "muted small" }, `95 %: ${between}`) : null];
  };
  /**
   * The unit of what drifts, and its name.
   * @param {Drift} row
   * @returns {[unit: string, name: string]}
   */
  const quantity = ({ what, unit }) => [unit.replace("/year", ""), what];
  return table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "What", cell: (row) => NAMES[row.what] ?? row.what },
      {
        title: "Drift per year, k = 2",
        number: true,
        cell: (row) => withUncertainty(row.per_year, row.u === null ? null : K * row.u, ...quantity(row)),
      },
      {
        title: "95 %, Student's t",
        number: true,
        cell: (row) =>
          row.low === null ? "–" : `${sizeText(row.low, ...quantity(row))} to ${sizeText(row.high, ...quantity(row))}`,
      },
      {
        title: "Repeatability",
        number: true,
        cell: (row) => sizeText(row.repeatability, ...quantity(row)),
      },
      {
        title: "Significance",
        cell: (row) => (row.u === null ? "" : row.significant ? chip("drifts", "warn") : chip("not significant")),
      },
      { title: "Leaves the limit", cell: when },
    ],
    trend.drifts,
    { label: "Drift" },
  );
}

/** @param {Trend} trend */
function pointTable(trend) {
  /** @param {{ version: number, rms_dps: number } | null} applied */
  const text = (applied) => (applied ? `${number(applied.rms_dps)} (version ${applied.version})` : "–");
  return table(
    [
      {
        title: "Recording",
        cell: (row) => h("a", { href: `/recordings/${row.recording}` }, `Recording ${row.recording}`),
      },
      { title: "Made", cell: (row) => day(row.at) },
      { title: "As found, deg/s RMS", number: true, cell: (row) => text(row.as_found) },
      { title: "As left, deg/s RMS", number: true, cell: (row) => text(row.as_left) },
      { title: `Version ${trend.version}, deg/s RMS`, number: true, cell: (row) => number(row.rms_dps) },
      trend.points.some((row) => row.why) ? { title: "Note", prose: true, cell: (row) => row.why } : null,
    ],
    trend.points,
    { label: "Recordings in time" },
  );
}
