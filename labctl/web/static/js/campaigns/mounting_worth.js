// How well a misalignment can be known with the mountings of a plan, and what further mountings are worth.

import { table } from "../core/components.js";
import { h } from "../core/elements.js";
import { duration, number } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";

/** @import { Plan } from "../../../types/api.js" */

const [MRAD] = shownUnit("1", "misalignment");

/**
 * Nothing where no unit turns across one of its outputs, or the bench states no angle.
 * @param {Plan["misalignment"]} outlook
 */
export function mountingWorth(outlook) {
  if (!outlook) return null;
  const { expanded, further, not_stated: lacking } = outlook;
  return h(
    "details",
    {},
    h("summary", {}, `Misalignment: U ${number(MRAD * expanded, 2)} mrad at best, by fixture and table`),
    further.length
      ? table(
          [
            { title: "With", cell: (each) => each.turned },
            { title: "U, mrad", number: true, cell: (each) => number(MRAD * each.expanded, 2) },
            { title: "More mountings", number: true, cell: (each) => String(each.mountings) },
            { title: "More time", cell: (each) => h("span", { class: "nowrap" }, duration(each.more_s)) },
            {
              title: "Table of the recipe then",
              prose: true,
              cell: (each) => h("pre", { class: "small" }, each.recipe_toml),
            },
          ],
          further,
          { label: "What further mountings of each position are worth" },
        )
      : h("p", { class: "muted" }, "No further mounting makes it smaller."),
    lacking.length
      ? h("p", { class: "muted" }, `Not in U, since the bench does not state it: ${lacking.join(", ")}.`)
      : null,
  );
}
