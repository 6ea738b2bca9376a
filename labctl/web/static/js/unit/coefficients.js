// Coefficients of a version: over temperature where it has a table, else a list; one version or two side by side.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { number, resultTexts, unitText, idText, withUncertainty } from "../core/format.js";
import { factList, table } from "../core/components.js";

const ERRORS = [
  ["rms_dps", "RMS"],
  ["heldout_rms_dps", "at unseen temperatures"],
  ["noise_floor_dps", "noise floor"],
];
/** Coverage factor of the bars: expanded uncertainty. */
const K = 2;

/** Errors and effects of two versions. */
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
      more.length ? `has ${more.map(idText).join(", ")} more` : "has nothing more",
      less.length ? ` and lacks ${less.map(idText).join(", ")}` : "",
      ` than version ${second.version}.`,
    ),
  );
}

export function coefficients(first, second) {
  const tabled = Object.values(first.axes).some((axis) => axis.temperature_c || axis.coefficients?.temperature_c);
  return tabled ? overTemperature(first, second) : list(first, second);
}

const tableOf = (axis) => (axis.coefficients?.temperature_c ? axis.coefficients : axis);

/** Factor and unit to display values in: plain numbers as shares in %, in ppm below 1 %. */
function scaleOf(values, unit) {
  if (unit !== "1") return [1, unitText(unit)];
  return Math.max(...values.map(Math.abs)) < 0.01 ? [1e6, "ppm"] : [100, "%"];
}

/** One plot per coefficient: its value over temperature with expanded uncertainty, one colour per axis. */
function overTemperature(first, second) {
  const names = new Set(
    Object.values(first.axes).flatMap((axis) =>
      Object.keys(tableOf(axis)).filter((name) => tableOf(axis)[name]?.value),
    ),
  );
  return h(
    "div",
    { class: "columns", style: "--column-min: 24rem" },
    [...names].map((name) => {
      const unit = Object.values(first.axes)
        .map((axis) => tableOf(axis)[name]?.unit)
        .find(Boolean);
      const rows = [first, second].filter(Boolean).flatMap((version) =>
        Object.entries(version.axes)
          .filter(([, axis]) => tableOf(axis)[name]?.value)
          .flatMap(([axis, values]) => {
            const {
              temperature_c,
              [name]: { value, u },
            } = tableOf(values);
            return value.map((each, k) => [version.version, axis, temperature_c[k], each, u?.[k], unit]);
          }),
      );
      const [factor, shown] = scaleOf(
        rows.map((row) => row[3]),
        unit,
      );
      const lines = (version, faint) =>
        Object.entries(version?.axes ?? {})
          .filter(([, axis]) => tableOf(axis)[name]?.value)
          .map(([axis, values]) => {
            const {
              temperature_c: x,
              [name]: { value, u },
            } = tableOf(values);
            return {
              type: "scatter",
              mode: "lines+markers",
              name: `axis ${axis}${second ? `, v${version.version}` : ""}`,
              x,
              y: value.map((each) => (each === null ? null : factor * each)),
              error_y:
                faint || !u
                  ? undefined
                  : { type: "data", array: u.map((each) => K * factor * each), thickness: 1, width: 2 },
              line: { color: axisColour(axis), dash: faint ? "dot" : "solid", width: faint ? 1.2 : 2 },
              marker: { size: faint ? 4 : 6 },
              opacity: faint ? 0.7 : 1,
            };
          });
      const draw = () => ({
        data: [...lines(first, false), ...lines(second, true)],
        layout: {
          xaxis: { title: { text: "temperature, deg C" } },
          yaxis: {
            title: { text: shown ? `${idText(name)}, ${shown}` : idText(name), font: { color: colour("text-muted") } },
          },
        },
      });
      return h(
        "div",
        {},
        h("h3", {}, idText(name)),
        figure(`Coefficient ${idText(name)}`, "Bars: expanded uncertainty, k = 2.", draw, {
          height: "17rem",
          csv: () => [["version", "axis", "temperature_c", name, "u", "unit"], ...rows],
        }),
      );
    }),
  );
}

/** A coefficient with its expanded uncertainty: texts of the same place, and the unit. */
function shownResult({ value, u, unit }) {
  const { middle, half, power, suffix } = resultTexts(value, u === null ? null : K * u, unit);
  return {
    value: power ? `${middle} ${power}` : middle,
    u: half === null ? "–" : power ? `${half} ${power}` : half,
    unit: suffix || "–",
  };
}

function list(first, second) {
  const rows = Object.entries(first.axes).flatMap(([axis, { coefficients: own }]) =>
    Object.entries(own ?? {}).map(([name, found]) => ({
      axis,
      name,
      ...found,
      shown: shownResult(found),
      beside: second?.axes[axis]?.coefficients?.[name],
    })),
  );
  return table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "Coefficient", cell: (row) => h("code", {}, row.name) },
      { title: "Value", number: true, cell: (row) => row.shown.value },
      { title: "Expanded uncertainty, k = 2", number: true, cell: (row) => row.shown.u },
      { title: "Unit", cell: (row) => row.shown.unit },
      second
        ? {
            title: `Version ${second.version}`,
            number: true,
            cell: (row) =>
              row.beside
                ? withUncertainty(row.beside.value, row.beside.u === null ? null : K * row.beside.u, row.beside.unit)
                : "–",
          }
        : null,
      second
        ? {
            title: "Differs by",
            number: true,
            cell: (row) =>
              row.beside && row.u !== null && row.beside.u !== null
                ? `${number(Math.abs(row.value - row.beside.value) / Math.hypot(row.u, row.beside.u), 2)} u`
                : "–",
          }
        : null,
    ].filter(Boolean),
    rows,
    { dense: true, label: "Coefficients" },
  );
}
