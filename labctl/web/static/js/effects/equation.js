// The equation of an effect as the catalogue states it, each symbol explained, and where it is from.

import { h } from "../core/elements.js";
import { idText } from "../core/format.js";
import { unitText } from "../core/shown_unit.js";
import { table } from "../core/components.js";

/** @import { Effect } from "../../../types/api.js" */

/** @typedef {NonNullable<Effect["equation"]>["symbols"][number]} EquationSymbol */

/** @type {Record<EquationSymbol["kind"], string>} */
const KINDS = {
  coefficient: "coefficient, estimated by a fit",
  parameter: "shape",
  channel: "recording",
  other: "",
};
/** @type {Record<Effect["sources"][number]["gives"], string>} */
const GIVES = {
  equation: "the equation",
  definition: "the effect; the shape is labctl's own",
};

/**
 * MathML of the service as an element; the browser draws it.
 * @param {string} mathml
 */
export const mathElement = (mathml) =>
  document.importNode(new DOMParser().parseFromString(mathml, "application/xml").documentElement, true);

/** @param {Effect} effect */
export function equationParts(effect) {
  if (!effect.equation) return [h("p", { class: "muted" }, "This effect of another package does not state it.")];
  return [
    h(
      "div",
      { class: "equation", tabindex: "0", role: "group", "aria-label": `Equation of ${effect.id}` },
      mathElement(effect.equation.mathml),
    ),
    symbolTable(effect),
    h("h3", {}, "Sources"),
    h(
      "ul",
      { class: "plain small" },
      effect.sources.map((source) =>
        h("li", {}, `${source.work}: ${source.place} `, h("span", { class: "muted" }, `(${GIVES[source.gives]})`)),
      ),
    ),
  ];
}

/** @param {Effect} effect */
const symbolTable = (effect) =>
  table(
    [
      { title: "Symbol", cell: (each) => mathElement(each.mathml) },
      { title: "Meaning", prose: true, cell: (each) => each.meaning },
      { title: "Unit", cell: (each) => unitOf(each.unit) },
      {
        title: "Where",
        cell: (each) => [each.name ? h("code", {}, each.name) : null, each.name ? " " : null, whereOf(each)],
      },
    ],
    effect.equation?.symbols ?? [],
    { label: `Symbols of ${effect.id}` },
  );

/**
 * Where the value of a symbol is from: an index of the equation, which has no unit, is from nowhere.
 * @param {EquationSymbol} symbol
 */
const whereOf = ({ kind, unit, name }) => (unit === "" && !name ? "" : KINDS[kind]);

/** @param {string} unit */
const unitOf = (unit) => (unit === "" ? "index" : unit === "1" ? "1" : unitText(unit));

/**
 * The same, closed until it is wanted; nothing for an effect that is not in the catalogue, such as a formula.
 * @param {readonly Effect[]} effects
 * @param {string} id
 * @param {string} title
 */
export function equationDetails(effects, id, title = "Equation and source") {
  const effect = effects.find((each) => each.id === id);
  if (!effect) return null;
  const content = h("div", { class: "stack" });
  return h(
    "details",
    {
      class: "equation-details",
      ontoggle: () => content.childElementCount || content.append(...equationParts(effect)),
    },
    h("summary", { "aria-label": title === idText(id) ? `Equation of ${title}` : `${title} of ${idText(id)}` }, title),
    content,
  );
}
