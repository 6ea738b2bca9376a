// Units that are due: in words, and the start of a recalibration in one press.

import { post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { count, day, instant } from "../core/format.js";
import { actButton, notice, toast } from "../core/components.js";
import { navigate } from "../core/router.js";
import { askBenchClear } from "../bench/actions.js";

/** @import { Part } from "../core/long_list.js" */
/** @import { Bench, Unit } from "../../../types/api.js" */

/** How far ahead a unit that is due is shown; the service's own metric has the same. */
export const DUE_WITHIN = "30d";
/** Units that are listed, those first that were due first. */
export const DUE_SHOWN = 10;

/**
 * Enter the campaign that the version in force is from into the schedule: it begins as soon as the bench is free.
 * @param {Unit} unit
 * @param {readonly Bench[]} benches
 */
export function recalibrateButton(unit, benches) {
  const again = unit.recalibration;
  const bench = again && benches.find((each) => each.name === again.bench);
  if (!again || !bench) return null;
  return actButton(
    "Recalibrate",
    async () => {
      const clear = await askBenchClear(bench, { later: true });
      if (!clear) return;
      const made = await post("/api/campaigns", { body: { recipe: again.recipe, at: "now", ...clear } });
      toast("good", `${again.name} begins ${instant("due_at" in made ? made.due_at : null)}, your time.`);
      await navigate("/campaigns");
    },
    { kind: "tiny" },
  );
}

/**
 * A line for each of the first units that are due or overdue, and how many more there are; null without one.
 * @param {Part<Unit>} due
 * @param {readonly Bench[]} benches
 */
export function dueNotice({ rows: due, total }, benches) {
  if (!due.length) return null;
  const more = total - due.length;
  return notice(
    due.some((unit) => unit.overdue) ? "bad" : "warn",
    h(
      "ul",
      { class: "plain", "aria-label": "Units that are due" },
      due.map((unit) =>
        h(
          "li",
          { class: "row space-between" },
          h(
            "span",
            {},
            h("a", { href: `/units/${encodeURIComponent(unit.serial)}` }, unit.serial),
            ` ${unit.overdue ? "was" : "is"} due on ${unit.due ? day(unit.due) : "–"}.`,
          ),
          recalibrateButton(unit, benches),
        ),
      ),
      more > 0
        ? h(
            "li",
            {},
            `${count(more)} more ${more === 1 ? "unit is" : "units are"} due or overdue. `,
            h("a", { href: "/units?calibration=overdue" }, "All that are overdue"),
          )
        : null,
    ),
  );
}
