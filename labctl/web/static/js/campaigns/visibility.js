// What a plan could find, and what it could not, before anything is measured.

import { h } from "../core/dom.js";
import { number, words } from "../core/format.js";
import { notice, table } from "../core/parts.js";

/** Less than this of an effect left beside the usual model: the model takes it in by itself. */
const TAKEN_IN = 0.02;

const effect = (row) => h("a", { href: `/effects/${row.effect}` }, words(row.effect));

export function visibility(rows) {
  const seen = rows.filter((row) => row.visible).sort((a, b) => b.share - a.share);
  const fitted = rows.filter((row) => !row.visible && row.why === "schedule" && row.share < TAKEN_IN);
  const unseen = rows.filter((row) => !row.visible && !fitted.includes(row));
  return [
    h("p", {}, h("strong", {}, `It could find ${seen.length} of ${rows.length} effects`), unseen.length ? ` and could not find ${unseen.length}; ` : "; ", fitted.length ? `${fitted.length} are part of the usual model and are fitted.` : null),
    h("div", { class: "columns", style: "--least: 17rem" },
      table([
        { title: "Could be found", cell: effect },
        { title: "From this size on", number: true, cell: (row) => (row.smallest_size === null ? "–" : `${number(row.smallest_size, 2)} ${row.unit === "1" ? "(no unit)" : row.unit}`) },
        { title: "Left beside the model", cell: (row) => h("div", { class: "progress-cell", title: "How much of the effect the usual model does not take in by itself" }, h("div", { class: "meter" }, h("i", { style: `width: ${100 * row.share}%` })), h("span", { class: "small" }, `${Math.round(100 * row.share)} %`)) },
      ], seen, { label: "Effects this plan could find" }),
      h("div", { class: "stack" },
        unseen.length ? table([
          { title: "Could not be found", cell: effect },
          { title: "Why, and what would show it", cell: (row) => (row.why === "channel" ? `needs ${row.needs.map(words).join(", ")}, which is not logged` : [h("span", {}, "this schedule does not part it from the rest"), row.experiment ? h("span", { class: "soft small beside" }, `Try: ${row.experiment}`) : null]) },
        ], unseen, { label: "Effects this plan could not find" }) : notice("good", "Nothing of the catalogue stays hidden from it."),
        fitted.length ? h("p", { class: "soft small" }, "In the usual model already: ", fitted.flatMap((row, k) => (k ? [", ", effect(row)] : [effect(row)])), ".") : null)),
  ];
}
