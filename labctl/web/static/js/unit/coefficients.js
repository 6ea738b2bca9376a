// Coefficients of a version: over temperature where it has a table, else a list; one version or two side by side.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { number, resultTexts, idText, withUncertainty } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";
import { factList, table } from "../core/components.js";
import { byHand } from "./by_hand.js";
import {
  coefficientColumns,
  columnsBeside,
  correlatedText,
  differenceOf,
  differenceText,
  isSingle,
  nominalText,
  sharedRecordings,
  termsText,
} from "./coefficient_table.js";
import { heldText } from "./held.js";

/** @import { Coefficient, Version } from "../../../types/api.js" */
/** @import { CoefficientColumn } from "./coefficient_table.js" */

/** @type {["rms_dps" | "heldout_rms_dps" | "noise_floor_dps", string][]} */
const ERRORS = [
  ["rms_dps", "RMS"],
  ["heldout_rms_dps", "at temperatures left out of the fit"],
  ["noise_floor_dps", "noise floor"],
];
const FIT_ALONE =
  "The uncertainties are those of the fit alone. What the model leaves and the reference standards count in the uncertainty in use below; the command labctl uncertainty states it for each coefficient.";
const DEFINITION =
  "Each coefficient is that of its term in the equation of the model, and all terms are fitted together. The performance sheet below states other quantities: bias, slope of the best straight line and asymmetry of the uncorrected output (IEEE Std 528), each by itself.";
/** Coverage factor of the bars: expanded uncertainty. */
const K = 2;

/**
 * Errors and effects of two versions.
 * @param {Version} first
 * @param {Version} second
 */
export function comparison(first, second) {
  const [own, other] = [first, second].map((each) => ({
    version: each.version,
    effects: each.model.effects,
    columns: coefficientColumns(each).length > 0,
  }));
  return h(
    "div",
    { class: "stack" },
    factList(
      ERRORS.filter(([key]) => first.error[key] !== null || second.error[key] !== null).map(([key, title]) => [
        title,
        number(first.error[key]),
        "deg/s",
        `version ${second.version}: ${number(second.error[key])}`,
      ]),
    ),
    h("p", {}, differenceText(own, other)),
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
  const columns = coefficientColumns(first);
  const isKnown =
    columns.some(({ u }) => u.some((each) => each !== null)) || singles(first).some(({ u }) => u !== null);
  const note = isKnown ? h("p", { class: "muted small" }, FIT_ALONE) : null;
  const terms = termsText(first);
  const nominal = new Set([first, ...(second ? [second] : [])].map(nominalText).filter(Boolean));
  const correlated = second && correlatedText(first, second);
  const meaning = [
    correlated ? h("p", { class: "muted small" }, correlated) : null,
    [...nominal].map((text) => h("p", {}, text)),
    h("p", { class: "muted small" }, terms ? `${terms} ` : null, equations(first)),
    h("p", { class: "muted small" }, DEFINITION),
  ];
  if (columns.length) return h("div", { class: "stack" }, held, overTemperature(first, second), meaning, note);
  return h("div", { class: "stack" }, held, list(first, second), meaning, note, byHand(first));
}

/**
 * Links to the equations of the effects of a version, which define its coefficients.
 * @param {Version} version
 */
const equations = ({ model }) => [
  "Equations: ",
  ...model.effects.flatMap((id, k) => [
    k ? ", " : "",
    h("a", { href: `/effects/${encodeURIComponent(id)}` }, idText(id)),
  ]),
  ".",
];

/**
 * One plot per coefficient: its value over temperature with expanded uncertainty, one colour per axis.
 * @param {Version} first
 * @param {Version | null} second
 */
function overTemperature(first, second) {
  const own = coefficientColumns(first).map((column) => ({ ...column, version: first.version }));
  const other = second ? columnsBeside(second, own).map((column) => ({ ...column, version: second.version })) : [];
  const columns = [...own, ...other];
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
      xaxis: { title: { text: "temperature, °C" } },
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
    figure(`Coefficient ${idText(name)}`, "Bars: expanded uncertainty of the fit, k = 2.", draw, {
      height: "17rem",
      csv,
    }),
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
      return [
        {
          axis,
          name,
          ...found,
          beside: isSingle(other) ? other : null,
          missing: other ? "changes with temperature" : "–",
        },
      ];
    }),
  );
  /** @param {typeof rows[number]} row */
  const texts = (row) => shownResult(row, row.name);
  const shared = second !== null && sharedRecordings(first, second).length > 0;
  return table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "Coefficient", cell: (row) => h("code", {}, row.name) },
      { title: "Value", number: true, cell: (row) => texts(row).value },
      { title: "Expanded uncertainty of the fit, k = 2", number: true, cell: (row) => texts(row).u },
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
                : row.missing,
          }
        : null,
      second
        ? {
            title: "Difference",
            number: true,
            cell: (row) => differenceOf(row, row.beside, { name: row.name, shared }),
          }
        : null,
    ],
    rows,
    { dense: true, label: "Coefficients" },
  );
}

/** @param {Version} version */
const singles = ({ axes }) =>
  Object.values(axes).flatMap(({ coefficients: own }) => Object.values(own).filter(isSingle));
