// The shape of a suspected effect as sliders: for another shape, size and all other coefficients are fitted again.

import { setChildren, h } from "../core/elements.js";
import { plainNumber } from "../core/format.js";
import { button } from "../core/components.js";
import { messageOf } from "../core/http/errors.js";
import { sliderAt, termOf, valueAt } from "./what_if_numbers.js";

/** @import { Parameter, Suspect } from "../../../types/api.js" */

const POSITIONS = 60;
/** A slider goes from the fitted value divided by this to the fitted value times this, within the parameter's range. */
const MAX_RATIO = 3;

/**
 * A slider for each parameter of the effect's shape; null where it has none.
 * @param {Suspect} suspect
 * @param {readonly Parameter[]} parameters
 * @param {(term: string | null) => Promise<void>} chosen called with the effect in another shape; null: in the fitted one
 */
export function shapeSliders(suspect, parameters, chosen) {
  const stated = parameters.filter(({ name }) => name in suspect.parameters);
  // without a symbol it is a switch of the equation; one that is refined is found by the fit, whatever is stated
  const free = stated.filter(({ symbol, refined }) => symbol && !refined);
  if (!free.length) return null;
  const values = Object.fromEntries(stated.map(({ name }) => [name, suspect.parameters[name]]));
  const state = h("output", { class: "what-if-words" });
  let asked = 0;
  /** @param {string | null} term */
  async function ask(term) {
    const mine = ++asked;
    setChildren(state, "Fitting with this shape…");
    try {
      await chosen(term);
      if (mine === asked) setChildren(state, term ? "Fitted again with this shape." : "");
    } catch (error) {
      if (mine === asked) setChildren(state, messageOf(error));
    }
  }
  const sliders = free.map((given) => {
    const at = suspect.parameters[given.name];
    const near = { low: Math.max(given.low, at / MAX_RATIO), high: Math.min(given.high, at * MAX_RATIO) };
    const parameter = { ...given, ...(given.low > 0 ? near : {}) };
    const text = h("span", { class: "muted small" });
    const show = () => setChildren(text, `${plainNumber(values[parameter.name], 3)} ${parameter.unit}`.trim());
    const input = /** @type {HTMLInputElement} */ (
      h("input", {
        type: "range",
        min: "0",
        max: String(POSITIONS),
        value: String(POSITIONS * sliderAt(parameter, values[parameter.name])),
        step: "any",
        "aria-label": `${parameter.meaning || parameter.name}, ${parameter.unit}`,
        oninput: () => {
          values[parameter.name] = valueAt(parameter, Number(input.value) / POSITIONS);
          show();
        },
        onchange: () => ask(termOf(suspect.effect, values)),
      })
    );
    const back = () => {
      values[parameter.name] = suspect.parameters[parameter.name];
      input.value = String(POSITIONS * sliderAt(parameter, values[parameter.name]));
      show();
    };
    show();
    const label = parameter.meaning || parameter.name.replaceAll("_", " ");
    return { back, element: h("label", { class: "field what-if-slider" }, `Shape: ${label}`, input, text) };
  });
  const fitted = button(
    "Fitted shape",
    () => {
      for (const { back } of sliders) back();
      return ask(null);
    },
    { kind: "tiny" },
  );
  return h(
    "div",
    { class: "row" },
    sliders.map(({ element }) => element),
    fitted,
    state,
  );
}
