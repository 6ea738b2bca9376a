// The designer: an uncertainty or hours are asked for, and the cheapest recipe that gives them is found, with its reasons.

import { post } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { count, duration, number } from "../core/format.js";
import { busyIndicator, button, chip, notice, table } from "../core/components.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { firstModels } from "../explore/first_models.js";
import { designBody } from "./designer_request.js";
import { movedPoints } from "./moved_points.js";

/** @import { Design, DesignedCampaign, Recipe, TiltedDesign } from "../../../types/api.js" */

const MODELS = firstModels("rates");

/**
 * @typedef {object} Row a recipe of the answer
 * @property {string} name what it is in the answer
 * @property {DesignedCampaign} recipe
 */

/**
 * The card, closed at first. `source()` gives the recipe of the page; `taken(text)` is called with the one that a person
 * takes.
 * @param {readonly Recipe[]} all
 * @param {() => string} source
 * @param {(text: string) => unknown} taken
 * @param {AbortSignal} signal of the page
 */
export function designerCard(all, source, taken, signal) {
  const place = h("div", { class: "stack" });
  const details = h(
    "details",
    {
      class: "card stack",
      /** @param {Event} event */
      ontoggle: (event) => {
        if (!(/** @type {HTMLDetailsElement} */ (event.target).open) || place.childElementCount) return;
        setChildren(place, form(all, taken, signal), movedPoints(source, taken, signal));
      },
    },
    h("summary", {}, h("strong", {}, "Design a campaign for an uncertainty")),
    place,
  );
  return details;
}

/**
 * @param {readonly Recipe[]} all
 * @param {(text: string) => unknown} taken
 * @param {AbortSignal} signal
 */
function form(all, taken, signal) {
  const asked = { like: "", model: "", u_dps: "0.004", hours: "" };
  const answer = h("div", { class: "stack", "aria-live": "polite" });
  /**
   * @param {"u_dps" | "hours"} name
   * @param {string} label
   * @param {string} hint
   */
  const numberField = (name, label, hint) =>
    labelledField(
      label,
      h("input", {
        type: "number",
        min: "0",
        step: "any",
        value: asked[name],
        /** @param {Event} event */
        oninput: (event) => {
          asked[name] = /** @type {HTMLInputElement} */ (event.target).value;
        },
      }),
      hint,
    );
  async function design() {
    setChildren(answer, busyIndicator("Planning about a hundred recipes on the bench; half a minute at most."));
    try {
      const found = await post("/api/designs", { body: designBody(asked), signal });
      setChildren(answer, shown(found, taken));
    } catch (error) {
      if (!isAbort(error)) setChildren(answer, notice("bad", messageOf(error)));
    }
  }
  return [
    h(
      "div",
      { class: "row", style: "align-items: flex-start" },
      selectField(
        "Ranges of",
        [option("", "the bench and its units"), ...all.map(({ name }) => option(name, name))],
        "",
        (value) => {
          asked.like = value;
        },
      ),
      selectField(
        "Model",
        [option("", "that of the recipe"), ...MODELS.map(({ id, text }) => option(id, text))],
        "",
        (value) => {
          asked.model = value;
        },
      ),
      numberField("u_dps", "U of a corrected rate, deg/s", "k = 2, everywhere in the range; empty: the smallest."),
      numberField("hours", "Hours at most", "Empty: no limit."),
    ),
    h("div", { class: "row" }, button("Design", design)),
    answer,
  ];
}

/**
 * The recipes of an answer, the chosen one first.
 * @param {Design} found
 * @returns {Row[]}
 */
const rowsOf = (found) => [
  { name: "chosen", recipe: found.chosen },
  ...found.others.map((recipe) => ({ name: "next best", recipe })),
  ...(found.reference ? [{ name: found.reference_name, recipe: found.reference }] : []),
];

/**
 * What was found: the choice with its reasons, the others, and what any recipe would take.
 * @param {Design} found
 * @param {(text: string) => unknown} taken
 */
function shown(found, taken) {
  const { chosen, bound } = found;
  const model = [found.model, ...found.effects].filter(Boolean).join("+");
  return [
    notice(
      found.is_reached ? "good" : "warn",
      h(
        "p",
        { class: "lead" },
        `${number(chosen.hours)} h for U = ${number(chosen.u_worst_dps)} deg/s with ${model}: ${chosen.text}.`,
      ),
      h(
        "div",
        { class: "row" },
        button("Take this recipe", () => taken(found.recipe_toml), { kind: "tiny" }),
      ),
    ),
    h(
      "ul",
      { class: "small" },
      found.decisions.map((each) => h("li", {}, each)),
    ),
    comparisonFigure(found),
    comparisonTable(found),
    found.reference_refused ? notice("", `${found.reference_name}: ${found.reference_refused}`) : null,
    bound
      ? h(
          "p",
          { class: "small" },
          `At best ${number(bound.bound_h)} h: ${number(bound.heat_h)} h of ramps and mountings, ${duration(3600 * bound.noise_h)} of readings to average the white noise. The chosen recipe takes ${number(bound.ratio)} times as long.`,
        )
      : null,
    found.tilted ? tiltedText(found.tilted, taken) : null,
    found.units_at_once > 1
      ? h("p", { class: "small" }, `${found.units_at_once} units at once: ${number(chosen.hours_per_unit)} h per unit.`)
      : null,
    found.standards_u_dps === null
      ? null
      : h(
          "p",
          { class: "small" },
          `Beside it, fixture and table leave ${number(found.standards_u_dps)} deg/s at the largest rate, whatever the recipe.`,
        ),
    h(
      "details",
      {},
      h("summary", {}, `Figures that the prediction counts with; ${count(found.tried)} recipes were planned`),
      h(
        "ul",
        { class: "small" },
        found.assumptions.map((each) => h("li", {}, each)),
      ),
    ),
  ];
}

/**
 * What a tilted fixture is worth; its recipe can be taken where the bench has one.
 * @param {TiltedDesign} tilted
 * @param {(text: string) => unknown} taken
 */
function tiltedText({ position, is_on_bench: has, best, without, bound, recipe_toml: text }, taken) {
  const others = without ? ` Without it ${number(without.hours)} h for U = ${number(without.u_worst_dps)} deg/s.` : "";
  const least = bound ? ` (at best ${number(bound.bound_h)} h)` : "";
  const fixture = has ? "the tilted fixture" : "a tilted fixture, which the bench file does not state,";
  return h(
    "div",
    { class: "row" },
    h(
      "p",
      { class: "small" },
      `With ${fixture} that brings ${position} up: ${number(best.hours)} h for U = ${number(best.u_worst_dps)} deg/s${least}.${others}`,
    ),
    has ? button("Take this one", () => taken(text), { kind: "tiny" }) : null,
  );
}

/**
 * Hours and U of every recipe of the answer, and the bound.
 * @param {Design} found
 */
function comparisonFigure(found) {
  const rows = rowsOf(found);
  const draw = () => ({
    data: [
      {
        type: "scatter",
        mode: "markers",
        name: "recipes",
        x: rows.map(({ recipe }) => recipe.hours),
        y: rows.map(({ recipe }) => recipe.u_worst_dps),
        text: rows.map(({ name, recipe }) => `${name}: ${recipe.text}`),
        marker: {
          size: rows.map(({ name }) => (name === "chosen" ? 13 : 8)),
          color: rows.map(({ name }) => colour(name === "chosen" ? "good" : name === "next best" ? "accent" : "warn")),
        },
        hovertemplate: "%{x:.3g} h, U = %{y:.3g} deg/s<extra>%{text}</extra>",
      },
    ],
    layout: {
      margin: { l: 76, r: 12, t: 12, b: 42 },
      showlegend: false,
      xaxis: { title: { text: "bench hours, h" }, rangemode: "tozero" },
      yaxis: { title: { text: "largest U (k = 2), deg/s" }, rangemode: "tozero" },
      shapes: found.bound
        ? [
            {
              type: "line",
              yref: "paper",
              y0: 0,
              y1: 1,
              x0: found.bound.bound_h,
              x1: found.bound.bound_h,
              line: { color: colour("text"), dash: "dot", width: 1.4 },
            },
          ]
        : [],
    },
  });
  return figure(
    "Hours and uncertainty of the recipes",
    `Green: chosen; blue: next best; amber: ${found.reference_name}. Dotted: the least hours of any recipe.`,
    draw,
    {
      height: "15rem",
      csv: () => [
        ["recipe", "what it does", "hours_h", "largest_u_dps", "rms_u_dps"],
        ...rows.map(({ name, recipe }) => [name, recipe.text, recipe.hours, recipe.u_worst_dps, recipe.u_rms_dps]),
      ],
    },
  );
}

/** @param {Design} found */
const comparisonTable = (found) =>
  table(
    [
      { title: "Recipe", cell: ({ name, recipe }) => [chip(name, name === "chosen" ? "good" : ""), " ", recipe.text] },
      { title: "Hours", number: true, cell: ({ recipe }) => number(recipe.hours) },
      { title: "Largest U, deg/s", number: true, cell: ({ recipe }) => number(recipe.u_worst_dps) },
      { title: "RMS U, deg/s", number: true, cell: ({ recipe }) => number(recipe.u_rms_dps) },
      { title: "Data sets", number: true, cell: ({ recipe }) => count(recipe.datasets) },
    ],
    rowsOf(found),
    { label: "Recipes" },
  );
