// Form for a simulated bench: choose an effect to hide in the simulated unit.

import { setChildren, h } from "../core/elements.js";
import { number, sizeText, idText } from "../core/format.js";
import { unitText } from "../core/shown_unit.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { updateQuery } from "../core/router.js";

/** @import { Effect, Visibility } from "../../../types/api.js" */

const DEFAULT_SIZE_FACTOR = 10;

/**
 * `asked` is the effect of the address. `chosen(list)` is called with the value for `hide` of the API.
 * `.sizes(visibility)` takes the smallest visible size of each effect.
 * @param {readonly Effect[]} effects
 * @param {string | undefined} asked
 * @param {(hide: string[]) => unknown} chosen
 */
export function hiddenEffectForm(effects, asked, chosen) {
  /** @type {readonly Visibility[]} */
  let seen = [];
  let row = { effect: effects.find((each) => each.id === asked)?.id ?? "", size: "" };
  const beside = h("div", { class: "row", style: "align-items: start; flex: 1 1 20rem" });
  const tell = () => chosen(row.effect ? [row.size === "" ? row.effect : `${row.effect}=${row.size}`] : []);
  function show() {
    if (!row.effect) return setChildren(beside);
    const about = effects.find((each) => each.id === row.effect);
    const can = seen.find((each) => each.effect === row.effect);
    const unit = unitText(about?.unit);
    /** @type {HTMLInputElement} */
    const input = h("input", {
      type: "number",
      step: "any",
      value: row.size,
      placeholder: "the simulator's default",
      oninput: () => {
        row.size = input.value;
        tell();
      },
    });
    const hint =
      can?.visible && can.smallest_size
        ? `This plan detects the effect if its size is at least ${number(can.smallest_size, 2)} ${unit || `(${sizeText(can.smallest_size, "1", can.effect)})`} on.`
        : can
          ? "This plan cannot detect the effect."
          : null;
    return setChildren(
      beside,
      labelledField(unit ? `Size, ${unit}` : "Size", input, hint),
      h("p", { class: "muted small", style: "flex: 1 1 14rem" }, about?.sentence ?? ""),
    );
  }
  const pick = selectField(
    "Effect to hide",
    [["", "none"], ...effects.map((each) => option(each.id, idText(each.id)))],
    row.effect,
    (value) => {
      row = { effect: value, size: usual(value) };
      updateQuery({ hide: value });
      show();
      tell();
    },
  );
  /**
   * A size well above the smallest visible one.
   * @param {string} effect
   */
  function usual(effect) {
    const can = seen.find((each) => each.effect === effect);
    return can?.visible && can.smallest_size
      ? String(Number((DEFAULT_SIZE_FACTOR * can.smallest_size).toPrecision(2)))
      : "";
  }
  const element = h("div", { class: "row", style: "align-items: start" }, pick, beside);
  /** @param {readonly Visibility[]} visibility */
  const sizes = (visibility) => {
    seen = visibility;
    if (row.size === "") row.size = usual(row.effect);
    show();
    tell();
  };
  return Object.assign(element, { sizes });
}
