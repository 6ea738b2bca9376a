// The points of the recipe of the page, moved by hand: hours, U and what can be seen follow; the last request wins.

import { post } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { count, idText, number, plainNumber, sizeText } from "../core/format.js";
import { button, factList, loadInto, notice } from "../core/components.js";
import { pointPlan } from "./point_plan.js";
import { shownRange } from "./point_numbers.js";

/** @import { EvaluatedRecipe, Plan } from "../../../types/api.js" */

/** A pause after the last movement before the service is asked, ms. */
const SETTLE_MS = 200;

/**
 * A button that shows the points of a recipe to move. `source()` gives the recipe of the page, `taken(text)` takes one.
 * @param {() => string} source
 * @param {(text: string) => unknown} taken
 * @param {AbortSignal} signal of the page
 */
export function movedPoints(source, taken, signal) {
  const place = h("div", { class: "stack" });
  const open = () =>
    loadInto(place, "Evaluating the recipe", async () => {
      const recipe = source();
      const found = await post("/api/designs/evaluation", { body: { recipe }, signal });
      return editor(recipe, found, taken, signal);
    });
  return h(
    "div",
    { class: "stack" },
    h("div", { class: "row" }, button("Move the points of the recipe that is chosen", open)),
    place,
  );
}

/**
 * @param {string} recipe
 * @param {EvaluatedRecipe} first
 * @param {(text: string) => unknown} taken
 * @param {AbortSignal} signal
 */
function editor(recipe, first, taken, signal) {
  const levels = { rates: [...first.rates_dps], temperatures: [...first.temperatures_c] };
  const use = { rates: pair(first.use_rates_dps), temperatures: pair(first.use_temperatures_c) };
  const shown = {
    rates: shownRange(levels.rates, use.rates, pair(first.allowed_rates_dps)),
    temperatures: shownRange(levels.temperatures, use.temperatures, pair(first.allowed_temperatures_c)),
  };
  const [numbers, seen] = [h("div", { "aria-live": "polite" }), h("p", { class: "small", "aria-live": "polite" })];
  let latest = first;
  let asked = new AbortController();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let waiting;

  async function ask() {
    const given = AbortSignal.any([signal, asked.signal]);
    try {
      const body = { recipe, rates_dps: levels.rates, temperatures_c: levels.temperatures };
      latest = await post("/api/designs/evaluation", { body, signal: given });
      setChildren(numbers, outcome(latest, first));
      take.toggleAttribute("disabled", !latest.evaluated);
      await see(given);
    } catch (error) {
      if (isAbort(error)) return; // a later request is on its way
      setChildren(numbers, notice("bad", messageOf(error)));
    }
    element.removeAttribute("aria-busy");
  }
  /** @param {AbortSignal} given */
  async function see(given) {
    setChildren(seen, "Computing which effects the plan can detect.");
    const body = { recipe: latest.recipe_toml, visibility: true };
    setChildren(seen, seenText(await post("/api/plans", { body, signal: given })));
  }
  function moved() {
    asked.abort(); // what was asked before is of other points
    asked = new AbortController();
    clearTimeout(waiting);
    element.setAttribute("aria-busy", "true");
    waiting = setTimeout(ask, SETTLE_MS);
  }
  const take = button("Take these points", () => taken(latest.recipe_toml), { kind: "primary tiny" });
  const element = h(
    "div",
    { class: "stack moved-points", role: "region", "aria-label": "Points of the recipe" },
    pointPlan(levels, shown, use, moved),
    h(
      "p",
      { class: "muted small" },
      "Drag a point, or a rate or a temperature at its edge; arrow keys move the one that has the focus, with Shift ten steps. Shaded: the range that U is of, that of the recipe as it was.",
    ),
    numbers,
    seen,
    h("div", { class: "row" }, take),
  );
  setChildren(numbers, outcome(first, first));
  take.toggleAttribute("disabled", !first.evaluated);
  see(signal).catch((error) => isAbort(error) || setChildren(seen, messageOf(error)));
  return element;
}

/**
 * @param {readonly number[]} range
 * @returns {[number, number]}
 */
const pair = ([low, high]) => [low, high];

/**
 * Hours and U, beside those of the recipe as it was.
 * @param {EvaluatedRecipe} now
 * @param {EvaluatedRecipe} first
 */
function outcome(now, first) {
  const { evaluated } = now;
  if (!evaluated) return notice("warn", now.why);
  const before = first.evaluated;
  return factList([
    ["Bench hours", number(evaluated.hours, 4), "h", before ? `as it was: ${number(before.hours, 4)}` : null],
    [
      "Largest U, k = 2",
      number(evaluated.u_worst_dps),
      "deg/s",
      before ? `as it was: ${number(before.u_worst_dps)}` : null,
    ],
    ["RMS U, k = 2", number(evaluated.u_rms_dps), "deg/s", before ? `as it was: ${number(before.u_rms_dps)}` : null],
    ["Data sets", count(evaluated.datasets)],
    ["Rates", now.rates_dps.map((rate) => plainNumber(rate)).join(", "), "deg/s"],
    ["Temperatures", now.temperatures_c.map((warm) => plainNumber(warm)).join(", "), "°C"],
  ]);
}

/** @param {Plan} plan */
function seenText({ visibility }) {
  const all = visibility ?? [];
  const able = all.filter(({ visible }) => visible).sort((a, b) => b.share - a.share);
  const names = able.map(({ effect, smallest_size, unit }) =>
    smallest_size === null ? idText(effect) : `${idText(effect)} from ${sizeText(smallest_size, unit, effect)}`,
  );
  return `This plan can detect ${able.length} of ${all.length} effects${names.length ? `: ${names.join(", ")}` : ""}.`;
}
