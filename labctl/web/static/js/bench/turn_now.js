// The turn by hand that is under way: what is asked, what has come out so far, and why the last attempt was refused.

import { h, setChildren } from "../core/elements.js";
import { notice } from "../core/components.js";
import { turnText } from "./turn_text.js";

/** @import { Campaign } from "../../../types/api.js" */

/** A card with `onStatus(status)`; hidden while no turn is under way. */
export function turnNow() {
  const text = h("p", { class: "lead", role: "status", "aria-label": "Angle so far" });
  const refused = h("div", { "aria-live": "assertive" });
  const bar = h("i", {});
  const meter = h("div", { class: "meter thick", "aria-hidden": "true" }, bar);
  const element = h("section", { class: "card", "aria-label": "The turn now", hidden: true }, text, meter, refused);
  let shown = "";
  /** @param {Campaign} status */
  function onStatus({ turn }) {
    element.hidden = !turn;
    if (!turn) return;
    const now = turnText(turn);
    setChildren(text, now.text);
    bar.style.width = `${(100 * now.share).toFixed(1)}%`;
    if (turn.refused === shown) return;
    shown = turn.refused;
    setChildren(refused, shown ? notice("warn", h("strong", {}, "Turn again: "), `${shown}.`) : null);
  }
  return Object.assign(element, { onStatus });
}
