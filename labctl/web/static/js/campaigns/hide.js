// On a simulated bench: an effect that the simulated unit has and its data sheet does not mention.

import { fill, h } from "../core/dom.js";
import { number, words } from "../core/format.js";
import { choice, field } from "../core/parts.js";

const USUAL_TIMES = 10;

/** `chosen(list)` gets what the API takes as `hide`. `.sizes(visibility)` tells from which size on the plan shows an effect. */
export function hiding(effects, chosen) {
  let [seen, row] = [[], { effect: "", size: "" }];
  const beside = h("div", { class: "row", style: "align-items: start; flex: 1 1 20rem" });
  const tell = () => chosen(row.effect ? [row.size === "" ? row.effect : `${row.effect}=${row.size}`] : []);
  function show() {
    if (!row.effect) return fill(beside);
    const about = effects.find((each) => each.id === row.effect);
    const can = seen.find((each) => each.effect === row.effect);
    const unit = can?.unit && can.unit !== "1" ? can.unit : "";
    const input = h("input", { type: "number", step: "any", value: row.size, placeholder: "the simulator's own", oninput: () => {
      row.size = input.value;
      tell();
    } });
    const hint = can?.visible && can.smallest_size ? `This plan shows it from ${number(can.smallest_size, 2)} ${unit} on.` : can ? "This plan would not show it." : null;
    return fill(beside, field(unit ? `Size, ${unit}` : "Size", input, hint), h("p", { class: "soft small", style: "flex: 1 1 14rem" }, about?.sentence ?? ""));
  }
  const pick = choice("Effect to hide", [["", "none"], ...effects.map((each) => [each.id, words(each.id)])], "", (value) => {
    const can = seen.find((each) => each.effect === value);
    row = { effect: value, size: can?.visible && can.smallest_size ? String(Number((USUAL_TIMES * can.smallest_size).toPrecision(2))) : "" };
    show();
    tell();
  });
  const element = h("div", { class: "row", style: "align-items: start" }, pick, beside);
  element.sizes = (visibility) => {
    seen = visibility;
    show();
  };
  return element;
}
