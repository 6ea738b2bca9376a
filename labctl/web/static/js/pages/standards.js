// The register of reference standards: the state of each, and the certificates, predictions, checks and findings that
// this rests on.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { day, number, personText } from "../core/format.js";
import { card, cardWithHeader, chip, emptyState, pageHeader, table, withCommands } from "../core/components.js";
import { figure } from "../core/figure.js";

/** @import { Standard } from "../../../types/api.js" */
/** @import { PageContext } from "../../../types/pages.js" */

/** @typedef {Standard["checks"][number]} Check */

/** @type {Record<Standard["state"], string>} */
const KINDS = { valid: "good", "no certificate": "warn", overdue: "bad", "check it": "warn", bad: "bad" };
/** @type {Record<Check["state"], string>} */
const CHECKS = { in: "good", warning: "warn", out: "bad", unknown: "" };
/** What the limits of a control chart rest on. @type {Record<string, { dash: string, text: string }>} */
const BASES = {
  history: { dash: "dash", text: "dashed by the earlier checks" },
  "stated u": { dash: "dot", text: "dotted by the uncertainties that are stated" },
};
/** @param {string} basis */
const isBy = (basis) => (/** @type {Check["limits"][number]} */ limits) => limits.basis === basis;
/** Limits of a control chart lie so many standard deviations from its centre. */
const LIMIT = 3;

/** @param {PageContext} context */
export async function page({ query: { on }, signal }) {
  const standards = await get("/api/standards", { query: on ? { on } : {}, signal });
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Reference standards",
      `The register: which standards the bench may use ${on ? `on ${day(on)}` : "today"}, and what that rests on.`,
    ),
    standards.length ? [card("All standards", overview(standards)), ...standards.map(standardCard)] : nothing(),
  );
}

const nothing = () =>
  emptyState(
    h("p", {}, "No reference standard is entered."),
    h(
      "p",
      {},
      withCommands("`labctl standards add` enters one, `labctl standards certificate` what its certificate states."),
    ),
  );

/** @param {Standard["state"]} state */
const stateChip = (state) => chip(state, KINDS[state]);

/** @param {readonly Standard[]} standards */
const overview = (standards) =>
  table(
    [
      { title: "Standard", cell: (row) => h("a", { href: `#${anchor(row)}` }, row.label) },
      { title: "Serial number", cell: (row) => row.serial || "–" },
      { title: "Quantity", cell: (row) => row.quantity },
      { title: "State", cell: (row) => stateChip(row.state) },
      { title: "Due", cell: (row) => day(row.due) },
      { title: "Certificate", cell: (row) => row.certificates.at(-1)?.number ?? "–" },
    ],
    standards,
    { label: "All standards" },
  );

/** @param {Pick<Standard, "label">} standard */
const anchor = ({ label }) => `standard-${encodeURIComponent(label)}`;

/** @param {Standard} standard */
function standardCard(standard) {
  const element = cardWithHeader(
    standard.label,
    stateChip(standard.state),
    standard.text.map((line) => h("p", {}, withCommands(line))),
    standard.description ? h("p", { class: "muted" }, standard.description) : null,
    certificates(standard),
    predictions(standard),
    checks(standard),
    findings(standard),
  );
  element.id = anchor(standard);
  return element;
}

/**
 * @param {string} title
 * @param {readonly unknown[]} rows
 * @param {() => HTMLElement | HTMLElement[]} make
 */
const part = (title, rows, make) => (rows.length ? [h("h3", {}, title), make()] : null);

/**
 * A value of a standard with its unit.
 * @param {number | null} value
 * @param {Standard} standard
 */
const sized = (value, { unit }) => (value === null ? "–" : `${number(value)} ${unit}`);

/** @param {number | null} nominal */
const nominalText = (nominal, /** @type {Standard} */ standard) =>
  nominal === null ? "all values" : sized(nominal, standard);

/** @param {Standard} standard */
const certificates = (standard) =>
  part("Certificates", standard.certificates, () =>
    table(
      [
        { title: "Number", cell: (row) => row.number },
        { title: "Laboratory", cell: (row) => row.laboratory },
        { title: "Calibrated", cell: (row) => day(row.calibrated) },
        { title: "Due", cell: (row) => day(row.due) },
        {
          title: "Error and U at each nominal value",
          cell: (row) =>
            row.points.map(({ nominal, value, u, k }) =>
              h(
                "div",
                {},
                `${nominalText(nominal, standard)}: ${sized(value, standard)}, U = ${sized(k * u, standard)} (k = ${k})`,
              ),
            ),
        },
        { title: "Traceability", prose: true, cell: (row) => row.traceability || "–" },
        { title: "Entered by", cell: (row) => `${personText(row.by)}, ${day(row.at)}` },
      ],
      [...standard.certificates].reverse(),
      { label: `Certificates of ${standard.label}` },
    ),
  );

/** @param {Standard} standard */
const predictions = (standard) =>
  part("Error and uncertainty in use", standard.predictions, () =>
    table(
      [
        { title: "Nominal value", cell: (row) => nominalText(row.nominal, standard) },
        { title: "On", cell: (row) => day(row.on) },
        { title: "Error, indicated minus true", number: true, cell: (row) => sized(row.value, standard) },
        { title: "u", number: true, cell: (row) => sized(row.u, standard) },
        {
          title: "Drift per year",
          cell: (row) =>
            row.per_year === null
              ? row.why
              : `${sized(row.per_year, standard)}, u = ${sized(row.u_per_year, standard)}, from ${row.certificates} certificates`,
        },
      ],
      standard.predictions,
      { label: `Predictions of ${standard.label}` },
    ),
  );

/** @param {Standard} standard */
const checks = (standard) =>
  part("Intermediate checks", standard.checks, () => [
    ...[...new Set(standard.checks.map((each) => each.nominal))].map((nominal) => controlChart(standard, nominal)),
    table(
      [
        { title: "Checked", cell: (row) => day(row.checked_at) },
        { title: "Nominal value", cell: (row) => nominalText(row.nominal, standard) },
        { title: "Error, indicated minus true", number: true, cell: (row) => sized(row.value, standard) },
        { title: "u", number: true, cell: (row) => sized(row.u, standard) },
        { title: "State", cell: (row) => chip(row.state, CHECKS[row.state]) },
        { title: "Note", prose: true, cell: (row) => row.note || "–" },
        { title: "By", cell: (row) => personText(row.by) },
      ],
      [...standard.checks].reverse(),
      { label: `Checks of ${standard.label}` },
    ),
  ]);

/**
 * The control chart of one nominal value: every check, and the limits that each was judged by.
 * @param {Standard} standard
 * @param {number | null} nominal
 */
function controlChart(standard, nominal) {
  const shown = standard.checks.filter((each) => each.nominal === nominal);
  const at = shown.map((each) => each.checked_at);
  /** The limits of each check by one basis; a check need not have all. */
  const bases = Object.keys(BASES).filter((basis) => shown.some(({ limits }) => limits.some(isBy(basis))));
  /**
   * @param {string} basis
   * @param {"low" | "high" | "centre"} name
   */
  const line = (basis, name) => ({
    type: "scatter",
    mode: "lines",
    x: at,
    y: shown.map(({ limits }) => limits.find(isBy(basis))?.[name] ?? null),
    line: { width: 1, dash: name === "centre" ? "solid" : BASES[basis].dash, color: "#888888" },
    name: `${name} by ${basis}`,
    hoverinfo: "skip",
  });
  const draw = () => ({
    data: [
      ...bases.flatMap((basis) => [line(basis, "low"), line(basis, "centre"), line(basis, "high")]),
      {
        type: "scatter",
        mode: "markers",
        x: at,
        y: shown.map((each) => each.value),
        error_y: { type: "data", array: shown.map((each) => each.u), thickness: 1 },
        marker: { size: 8, color: "#4477aa", symbol: shown.map((each) => (each.state === "out" ? "x" : "circle")) },
        name: "check",
        hovertemplate: `%{x|%d %b %Y}: %{y:.3~g} ${standard.unit}<extra></extra>`,
      },
    ],
    layout: {
      xaxis: { type: "date", title: { text: "day of the check" } },
      yaxis: { title: { text: `error, ${standard.unit}` } },
      showlegend: false,
      margin: { l: 70, r: 12, t: 8, b: 46 },
    },
  });
  const csv = () => [
    [
      "checked_at",
      `value_${standard.unit}`,
      `u_${standard.unit}`,
      "state",
      ...bases.flatMap((basis) => [`low by ${basis}`, `high by ${basis}`]),
    ],
    ...shown.map(({ checked_at, value, u, state, limits }) => [
      checked_at,
      value,
      u,
      state,
      ...bases.flatMap((basis) => {
        const by = limits.find(isBy(basis));
        return [by?.low, by?.high];
      }),
    ]),
  ];
  return figure(
    `Control chart of ${standard.label}${nominal === null ? "" : ` at ${sized(nominal, standard)}`}`,
    `All ${shown.length} checks (error: indicated minus true) with their standard uncertainties, and the limits of each, ${LIMIT} standard deviations from the centre: ${bases.map((basis) => BASES[basis].text).join(", ")}. A check beyond any of its limits is a cross.`,
    draw,
    { height: "14rem", csv },
  );
}

/** @param {Standard} standard */
const findings = (standard) =>
  part("Found bad", standard.findings, () =>
    table(
      [
        { title: "From", cell: (row) => day(row.bad_from) },
        { title: "Until", cell: (row) => (row.bad_until ? day(row.bad_until) : "still bad") },
        { title: "Reason", prose: true, cell: (row) => row.reason },
        { title: "By", cell: (row) => `${personText(row.by)}, ${day(row.at)}` },
        { title: "Withdrawn", prose: true, cell: (row) => row.withdrawn || "–" },
      ],
      standard.findings,
      { label: `Findings of ${standard.label}` },
    ),
  );
