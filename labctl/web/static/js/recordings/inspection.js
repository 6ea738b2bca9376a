// What is wrong with the readings of a recording before a fit, and a picture of every channel with the places of it.

import { get } from "../core/http/api.js";
import { h, whenNearViewport } from "../core/elements.js";
import { figure } from "../core/figure.js";
import { card, fitWarnings, loadInto } from "../core/components.js";
import { leftOutText } from "./leave_out.js";

/** @import { Inspection } from "../../../types/api.js" */
/** @import { Picture } from "../../../types/pages.js" */

/**
 * @param {number} recording
 * @param {AbortSignal} signal
 */
export function inspectionCard(recording, signal) {
  const place = h("div", { class: "stack" });
  const element = card("Inspection of the readings", place);
  whenNearViewport(element, () =>
    loadInto(place, "Inspecting the readings", async () =>
      inspected(await get("/api/recordings/{recording}/inspection", { path: { recording }, signal })),
    ),
  );
  return element;
}

/** @param {Inspection} found */
function inspected(found) {
  const left = found.left_out.map((each) => h("li", {}, leftOutText(each)));
  return h(
    "div",
    { class: "stack" },
    fitWarnings(found) ?? h("p", {}, "The inspection found nothing wrong."),
    left.length ? h("ul", {}, ...left) : null,
    found.picture ? drawn(found.picture) : null,
  );
}

/** @param {NonNullable<Inspection["picture"]>} picture */
function drawn({ figure: made, how_to_read: caption }) {
  const picture = /** @type {Picture & { layout: { height: number } }} */ (/** @type {unknown} */ (made));
  return figure("Inspection", caption, () => picture, { height: `${picture.layout.height}px` });
}
