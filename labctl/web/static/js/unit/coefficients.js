// Coefficients of a version: over temperature where it has a table, else a list; one version or two side by side.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { number, resultTexts, idText, withUncertainty } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";
import { factList, table } from "../core/components.js";
import { byHand } from "./by_hand.js";
import { coefficientColumns, isSingle } from "./coefficient_table.js";
import { heldText } from "./held.js";

/** @import { Coefficient, Version } from "../../../types/api.js" */
/** @import { CoefficientColumn } from "./coefficient_table.js" */

/** @type {["rms_dps" | "heldout_rms_dps" | "noise_floor_dps", string][]} */
const ERRORS = [
  ["rms_dps", "RMS"],
  ["heldout_rms_dps", "at temperatures left out of the fit"],
  ["noise_floor_dps", "noise floor"],
];
/** Coverage factor of the bars: expanded uncertainty. */
const K = 2;

/**
 * Errors and effects of two versions.
 * @param {Version} first
 * @param {Version} second
 */
export function comparison(first, second) {
  const [own, other] = [first, second].map((version) => new Set(version.model.effects));
  const more = [...own].filter((id) => !other.has(id));
  const less = [...other].filter((id) => !own.has(id));
  return h(
    "div",
    { class: "stack" },
    factList(
      ERRORS.map(([key, title]) => [
        title,
        number(first.error[key]),
        "deg/s",
        `version ${second.version}: ${number(second.error[key])}`,
      ]),
    ),
    h(
      "p",
      {},
      `Version ${first.version} `,
      more.length ? `has ${more.map(idText).join(", ")} more` : "has no further effect",
      less.length ? ` and lacks ${less.map(idText).join(", ")}` : "",
      ` than version ${second.version}.`,
    ),
  );
}

/**
 * @param {Version} first
 * @param {Version | null} second
 */
export function coefficients(first, second) {
  const held = [first, second]
    .flatMap((version) => (version && heldText(version)) ?? [])
    .map((text) => h("p", {}, text));
  if (coefficientColumns(first).length) return h("div", { class: "stack" }, held, overTemperature(first, second));
  return h("div", { class: "stack" }, held, list(first, second), byHand(first));
}

/**
 * One plot per coefficient: its value over temperature with expanded uncertainty, one colour per axis.
 * @param {Version} first
 * @param {Version | null} second
 */
function overTemperature(first, second) {
  const columns = [first, second]
    .filter((version) => version !== null)
    .flatMap((version) => coefficientColumns(version).map((column) => ({ ...column, version: version.version })));
  const names = new Set(columns.filter(({ version }) => version === first.version).map(({ name }) => name));
  return h(
    "div",
    { class: "columns", style: "--column-min: 24rem" },
    [...names].map((name) =>
      columnsFigure(
        name,
        columns.filter((column) => column.name === name),
        first.version,
      ),
    ),
  );
}

/** @typedef {CoefficientColumn & { version: number }} VersionColumn */

/**
 * @param {string} name
 * @param {readonly VersionColumn[]} columns
 * @param {number} front the version whose lines are solid; those of another one are dotted
 */
function columnsFigure(name, columns, front) {
  const { unit } = columns[0];
  const several = columns.some(({ version }) => version !== front);
  const [factor, shown] = shownUnit(unit, name);
  /** @param {VersionColumn} column */
  const line = ({ axis, version, temperature_c, value, u }) => {
    const faint = version !== front;
    return {
      type: "scatter",
      mode: "lines+markers",
      name: `axis ${axis}${several ? `, v${version}` : ""}`,
      x: temperature_c,
      y: value.map((each) => factor * each),
      error_y: faint
        ? undefined
        : { type: "data", array: u.map((each) => K * factor * (each ?? 0)), thickness: 1, width: 2 },
      line: { color: axisColour(axis), dash: faint ? "dot" : "solid", width: faint ? 1.2 : 2 },
      marker: { size: faint ? 4 : 6 },
      opacity: faint ? 0.7 : 1,
    };
  };
  const draw = () => ({
    data: columns.map(line),
    layout: {
      xaxis: { title: { text: "temperature, deg C" } },
      yaxis: {
        title: { text: shown ? `${idText(name)}, ${shown}` : idText(name), font: { color: colour("text-muted") } },
      },
    },
  });
  const csv = () => [
    ["version", "axis", "temperature_c", name, "u", "unit"],
    ...columns.flatMap(({ version, axis, temperature_c, value, u }) =>
      value.map((each, k) => [version, axis, temperature_c[k], each, u[k], unit]),
    ),
  ];
  return h(
    "div",
    {},
    h("h3", {}, idText(name)),
    figure(`Coefficient ${idText(name)}`, "Bars: expanded uncertainty, k = 2.", draw, { height: "17rem", csv }),
  );
}

/**
 * A coefficient with its expanded uncertainty: texts of the same place, and the unit.
 * @param {Coefficient} coefficient
 * @param {string} name
 */
function shownResult({ value, u, unit }, name) {
  const { middle, half, power, suffix } = resultTexts(value, u === null ? null : K * u, unit, name);
  return {
    value: power ? `${middle} ${power}` : middle,
    u: half === null ? "–" : power ? `${half} ${power}` : half,
    unit: suffix || "–",
  };
}

/**
 * @param {Version} first
 * @param {Version | null} second
 */
function list(first, second) {
  const rows = Object.entries(first.axes).flatMap(([axis, { coefficients: own }]) =>
    Object.entries(own).flatMap(([name, found]) => {
      const other = second?.axes[axis]?.coefficients[name];
      if (!isSingle(found)) return [];
      return [{ axis, name, ...found, beside: isSingle(other) ? other : null }];
    }),
  );
  /** @param {typeof rows[number]} row */
  const texts = (row) => shownResult(row, row.name);
  return table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "Coefficient", cell: (row) => h("code", {}, row.name) },
      { title: "Value", number: true, cell: (row) => texts(row).value },
      { title: "Expanded uncertainty, k = 2", number: true, cell: (row) => texts(row).u },
      { title: "Unit", cell: (row) => texts(row).unit },
      second
        ? {
            title: `Version ${second.version}`,
            number: true,
            cell: (row) =>
              row.beside
                ? withUncertainty(
                    row.beside.value,
                    row.beside.u === null ? null : K * row.beside.u,
                    row.beside.unit,
                    row.name,
                  )
                : "–",
          }
        : null,
      second
        ? {
            title: "Difference",
            number: true,
            cell: (row) =>
              row.beside && row.u !== null && row.beside.u !== null
                ? `${number(Math.abs(row.value - row.beside.value) / Math.hypot(row.u, row.beside.u), 2)} u`
                : "–",
          }
        : null,
    ],
    rows,
    { dense: true, label: "Coefficients" },
  );
}
