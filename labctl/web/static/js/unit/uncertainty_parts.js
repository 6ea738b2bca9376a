// The parts of an uncertainty at one rate and temperature.

import { h } from "../core/elements.js";
import { chip, table } from "../core/components.js";
import { number } from "../core/format.js";

/** @import { AxisUncertainty, Uncertainty } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */

/** @typedef {{ title: string, of: (one: AxisUncertainty) => Child, from: (one: AxisUncertainty) => string }} PartRow */

/** Parts of a standard uncertainty: title, value, where a known one is from. */
const PARTS = [
  {
    key: "coefficients",
    title: "Coefficients",
    /** @param {AxisUncertainty} one */
    of: (one) => one.coefficients_dps,
    from: () => "covariance of the fit",
  },
  {
    key: "model",
    title: "Model and drift nearby",
    /** @param {AxisUncertainty} one */
    of: (one) => one.model_dps,
    from: () => "data sets left out of the fit",
  },
  {
    key: "repeatability",
    title: "From one power-on to the next",
    /** @param {AxisUncertainty} one */
    of: (one) => one.repeatability_dps,
    /** @param {AxisUncertainty} one */
    from: (one) => one.repeatability_source ?? "",
  },
];
const STANDARDS = "Reference standards";
/**
 * Uncertainties have two significant digits (GUM 7.2.6).
 * @param {number | null} u_dps
 */
export const shown = (u_dps) => number(u_dps, 2);
export const unknown = () => h("span", { class: "warn-text" }, "unknown");
/** @param {readonly string[]} names */
export const joined = (names) => (names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names.at(-1)}` : names[0]);
/** @param {string} part */
export const titleOf = (part) => PARTS.find(({ key }) => key === part)?.title ?? part;

/** @param {Uncertainty} answer */
export function atPlace(answer) {
  const axes = Object.entries(answer.axes);
  /**
   * @param {number | null} value
   * @param {boolean} [strong]
   */
  const figure = (value, strong) =>
    value === null ? unknown() : strong ? h("strong", {}, shown(value)) : shown(value);
  const k = answer.coverage_factor;
  /** @type {(PartRow | null)[]} */
  const all = [
    ...PARTS.map(({ key, title, of, from }) => ({
      title,
      /** @param {AxisUncertainty} one */
      of: (one) => figure(of(one)),
      /** @param {AxisUncertainty} one */
      from: (one) => one.unknown[key] ?? from(one),
    })),
    {
      title: STANDARDS,
      of: (one) =>
        one.standards_dps === null ? h("span", { class: "warn-text" }, "not stated") : shown(one.standards_dps),
      from: (one) => (one.standards_dps === null ? "none is stated" : "the budget below names each"),
    },
    { title: "Combined", of: (one) => figure(one.combined_dps), from: becauseOf },
    { title: `Expanded, k = ${k}`, of: (one) => figure(one.expanded_dps, true), from: becauseOf },
    axes.some(([, one]) => one.expanded_dps === null && one.same_run_dps !== null)
      ? {
          title: `Same run, expanded, k = ${k}`,
          of: (one) => figure(one.same_run_dps === null ? null : k * one.same_run_dps),
          from: () => "coefficients, model and standards; valid until the unit is switched off",
        }
      : null,
  ];
  const rows = all.filter((row) => row !== null);
  return h(
    "div",
    { class: "stack" },
    answer.inside
      ? null
      : h(
          "p",
          {},
          chip("outside", "warn"),
          " This rate or temperature was not calibrated: the figures are extrapolated.",
        ),
    table(
      [
        { title: "Standard uncertainty, deg/s", cell: (row) => row.title },
        ...axes.map(([axis, one]) => ({
          title: `Axis ${axis}`,
          number: true,
          /** @param {PartRow} row */
          cell: (row) => row.of(one),
        })),
        { title: "From", prose: true, cell: (row) => byAxis(axes, row.from) },
      ],
      rows,
      { label: "Parts of the uncertainty" },
    ),
  );
}

/**
 * What an unknown sum lacks.
 * @param {AxisUncertainty} one
 */
const becauseOf = (one) =>
  one.combined_dps === null
    ? `unknown, as ${joined(Object.keys(one.unknown))} ${Object.keys(one.unknown).length > 1 ? "are" : "is"}`
    : one.repeatability_source === "between runs"
      ? "all parts, wider for few power-ons"
      : "all parts";

/**
 * A text of each axis, once where all say the same.
 * @param {readonly [string, AxisUncertainty][]} axes
 * @param {(one: AxisUncertainty) => string} text
 */
function byAxis(axes, text) {
  const texts = axes.map(([axis, one]) => [axis, text(one)]);
  if (new Set(texts.map(([, said]) => said)).size === 1) return texts[0][1];
  return texts.map(([axis, said]) => h("div", {}, `axis ${axis}: ${said}`));
}

/**
 * Why an uncertainty is unknown, without the name of the line of the budget that it is said of.
 * @param {string} why
 */
export const withoutPart = (why) => why.replace(/^(model|coefficients|repeatability): /, "");
