// On a simulated bench: an effect that the simulated unit has and its data sheet does not mention.

import { setChildren, h } from "../core/elements.js";
import { number, sizeText, unitText, idText } from "../core/format.js";
import { selectField, labelledField } from "../core/components.js";
import { updateQuery } from "../core/router.js";

const DEFAULT_SIZE_FACTOR = 10;

/** `asked` is the effect that the address names. `chosen(list)` gets what the API takes as `hide`. `.sizes(visibility)` tells from which size on the plan shows an effect. */
export function hiddenEffectForm(effects, asked, chosen) {
  let [seen, row] = [[], { effect: effects.some((each) => each.id === asked) ? asked : "", size: "" }];
  const beside = h("div", { class: "row", style: "align-items: start; flex: 1 1 20rem" });
  const tell = () => chosen(row.effect ? [row.size === "" ? row.effect : `${row.effect}=${row.size}`] : []);
  function show() {
    if (!row.effect) return setChildren(beside);
    const about = effects.find((each) => each.id === row.effect);
    const can = seen.find((each) => each.effect === row.effect);
    const unit = unitText(about?.unit);
    const input = h("input", { type: "number", step: "any", value: row.size, placeholder: "the simulator's own", oninput: () => {
      row.size = input.value;
      tell();
    } });
    const hint = can?.visible && can.smallest_size ? `This plan shows it from ${number(can.smallest_size, 2)} ${unit || `(${sizeText(can.smallest_size, "1")})`} on.` : can ? "This plan would not show it." : null;
    return setChildren(beside, labelledField(unit ? `Size, ${unit}` : "Size", input, hint), h("p", { class: "soft small", style: "flex: 1 1 14rem" }, about?.sentence ?? ""));
  }
  const pick = selectField("Effect to hide", [["", "none"], ...effects.map((each) => [each.id, idText(each.id)])], row.effect, (value) => {
    row = { effect: value, size: usual(value) };
    updateQuery({ hide: value });
    show();
    tell();
  });
  /** A size that the plan shows well. */
  function usual(effect) {
    const can = seen.find((each) => each.effect === effect);
    return can?.visible && can.smallest_size ? String(Number((DEFAULT_SIZE_FACTOR * can.smallest_size).toPrecision(2))) : "";
  }
  const element = h("div", { class: "row", style: "align-items: start" }, pick, beside);
  element.sizes = (visibility) => {
    seen = visibility;
    if (row.size === "") row.size = usual(row.effect);
    show();
    tell();
  };
  return element;
}
