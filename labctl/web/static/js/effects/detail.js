// The page of one effect.

import { h } from "../core/elements.js";
import { plainNumber, sizeText, idText } from "../core/format.js";
import { shownUnit, unitText } from "../core/shown_unit.js";
import { card, chip, pageHeader, notice, table } from "../core/components.js";
import { linkButton } from "../bench/actions.js";
import { signatureFigure } from "./signature_plot.js";
import { equationParts, mathElement } from "./equation.js";
import { CHANNELS, ORIGINS, TECHNOLOGIES, VIEWS } from "./labels.js";

/** @import { Effect } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */

/** @param {Effect} effect */
const effectLink = (effect) => h("a", { href: `/effects/${effect.id}` }, effect.term);
/**
 * @param {readonly Child[]} parts
 * @returns {Child[]}
 */
const commaSeparated = (parts) => parts.flatMap((part, k) => (k ? [", ", part] : [part]));

/**
 * @param {Effect} effect
 * @param {readonly Effect[]} all
 */
export function effectDetail(effect, all) {
  const at = all.indexOf(effect);
  /**
   * @param {Effect | undefined} to
   * @param {string} text
   */
  const turn = (to, text) => (to ? h("a", { class: "button tiny", href: `/effects/${to.id}` }, text) : null);
  const alike = all.filter(
    (each) => each !== effect && (effect.aliases.includes(each.id) || each.aliases.includes(effect.id)),
  );
  const [origin, about] = ORIGINS[effect.origin] ?? [effect.origin, ""];
  return h(
    "div",
    { class: "page effect" },
    pageHeader(
      effect.term,
      h(
        "span",
        { class: "row" },
        h("code", {}, effect.id),
        chip(origin, effect.leaves ? "accent" : ""),
        chip(effect.leaves ? "part of a calibration" : "not part of a calibration", effect.leaves ? "good" : ""),
      ),
      ...[turn(all[at - 1], "‹ Before"), turn(all[at + 1], "Next ›")].filter(Boolean),
    ),
    h("p", { class: "sentence" }, effect.sentence),
    h(
      "div",
      { class: "columns", style: "--column-min: 24rem" },
      card(
        "Signature",
        signatureFigure(effect) ?? h("p", { class: "muted" }, "There is no picture of this effect."),
        effect.draws.length
          ? h(
              "p",
              { class: "small" },
              h("strong", {}, "Where it shows: "),
              commaSeparated(effect.draws.map((view) => VIEWS[view] ?? idText(view))),
              ".",
            )
          : null,
      ),
      h(
        "div",
        { class: "stack", style: "gap: 1.25rem" },
        card(
          "The experiment",
          h(
            "p",
            { class: "lead" },
            effect.experiment
              ? `${effect.experiment[0].toUpperCase()}${effect.experiment.slice(1)}.`
              : "None is listed.",
          ),
          h(
            "div",
            { class: "row" },
            linkButton("Practise with it", `/campaigns/new?hide=${effect.id}`),
            h("span", { class: "muted small" }, "a simulated campaign in which this effect is hidden in the unit"),
          ),
        ),
        card(
          "Effects that look the same",
          alike.length
            ? [
                h(
                  "ul",
                  { class: "plain" },
                  alike.map((each) =>
                    h("li", {}, effectLink(each), h("span", { class: "muted small secondary" }, each.sentence)),
                  ),
                ),
                h(
                  "p",
                  { class: "muted small" },
                  "These effects have the same signature on every schedule, so a criticism always names them together.",
                ),
              ]
            : h(
                "p",
                { class: "muted" },
                "No other effect of the catalogue has the same signature on every schedule. With a given schedule of rates and temperatures other effects may look similar: then the verdict on a fit lists all of them.",
              ),
        ),
        card(
          "What it needs",
          effect.needs.length
            ? h(
                "p",
                {},
                "Besides rate and temperature: ",
                commaSeparated(
                  effect.needs.map((name) =>
                    h("span", {}, CHANNELS[name] ?? idText(name), " (", h("code", {}, name), ")"),
                  ),
                ),
                ".",
              )
            : h("p", {}, "A recording with rate and temperature is enough to test for this effect."),
          axesParagraph(effect),
        ),
      ),
    ),
    card("Equation", ...equationParts(effect)),
    h("div", { class: "columns" }, sizeCard(effect), shapeCard(effect)),
    notice(
      effect.leaves ? "good" : "",
      h("strong", {}, effect.leaves ? "Exported. " : "Not exported. "),
      effect.leaves
        ? "A calibration can contain this effect. The Python class Compensator, which applies a calibration to readings, then subtracts it."
        : ["sensor", "package"].includes(effect.origin)
          ? "The effect is a property of the unit, but its correction needs channels that are measured only on the bench."
          : about,
    ),
  );
}

/** @type {Record<string, string>} */
const AXES_TEXTS = {
  own: "The effect appears on the axis that turns.",
  cross: "The effect appears on the axes that do not turn.",
  all: "The effect appears on every axis.",
};
/** @param {Effect} effect */
const axesParagraph = (effect) => h("p", { class: "muted" }, AXES_TEXTS[effect.rows] ?? "");

/** What a number without a unit is, by the unit in which it is shown. @type {Record<string, string>} */
const SHARES = {
  ppm: "Values in ppm are millionths of the rate.",
  "%": "Values in % are the part of the full effect: of the band, the step, the law or the steps of the table.",
  mrad: "Values in mrad are angles: the part of the rate about another axis, in thousandths.",
};

/** @param {Effect} effect */
function sizeCard(effect) {
  const rows = Object.entries(effect.plausible);
  if (!rows.length)
    return card(
      "How large it is",
      h("p", { class: "muted" }, "The catalogue lists no plausible sizes for this effect."),
    );
  const unit = effect.unit ?? "";
  /** @param {number} value */
  const sizeCell = (value) => h("span", { class: "nowrap" }, sizeText(value, unit, effect.id));
  return card(
    "How large it is",
    table(
      [
        { title: "Technology", cell: ([name]) => TECHNOLOGIES[name] ?? name },
        { title: "From", number: true, cell: ([, [low]]) => sizeCell(low) },
        { title: "To", number: true, cell: ([, [, high]]) => sizeCell(high) },
      ],
      rows,
      { label: "Plausible sizes" },
    ),
    h(
      "p",
      { class: "muted small" },
      effect.unit === "1" ? SHARES[shownUnit(effect.unit, effect.id)[1]] : "Plausible sizes of its first coefficient.",
    ),
  );
}

/** @param {Effect} effect */
function shapeCard(effect) {
  const orders =
    effect.max_order === null
      ? null
      : h("p", {}, `A polynomial up to order ${effect.max_order}; ${effect.order} by default.`);
  if (!effect.parameters.length)
    return card(
      "Shape of the effect",
      orders ?? h("p", {}, "This effect has no shape parameters: its size describes it completely."),
    );
  return card(
    "Shape of the effect",
    orders,
    table(
      [
        {
          title: "Parameter",
          cell: (each) => [
            each.symbol_mathml ? mathElement(each.symbol_mathml) : null,
            each.symbol_mathml ? " " : null,
            h("code", {}, each.name),
          ],
        },
        { title: "Meaning", prose: true, cell: (each) => each.meaning },
        { title: "Searched from", number: true, cell: (each) => `${plainNumber(each.low)} ${unitText(each.unit)}` },
        { title: "to", number: true, cell: (each) => `${plainNumber(each.high)} ${unitText(each.unit)}` },
      ],
      effect.parameters,
      { label: "Parameters" },
    ),
    h(
      "p",
      { class: "muted small" },
      "Besides its size, this effect has shape parameters; the fit searches these ranges.",
    ),
  );
}
