// Visibility report: which effects a plan could detect and which not, before anything is measured.

import { h } from "../core/elements.js";
import { percent, sizeText, idText } from "../core/format.js";
import { notice, table } from "../core/components.js";
import { channelName } from "../recordings/channels.js";

/** @import { Visibility } from "../../../types/api.js" */

/** Below this share left beside the model of a first fit, that model absorbs the effect. */
const ABSORBED_SHARE = 0.02;

/** @param {{ effect: string }} row */
const effectLink = (row) => h("a", { href: `/effects/${row.effect}` }, idText(row.effect));

/** @param {Visibility} row */
const smallestSize = ({ effect, smallest_size, unit }) => sizeText(smallest_size, unit, effect);

/**
 * Why a plan cannot show an effect.
 * @param {Visibility} row
 */
function unseenText(row) {
  switch (row.why) {
    case "channel":
      return `needs ${row.needs.map(channelName).join(", ")}, which is not logged`;
    case "technology":
      return "gyros of this technology do not have it";
    case "size":
      return `not detectable by this plan: the effect would have to be ${smallestSize(row)}, which is more than this type of gyro can have`;
    default:
      return "this schedule does not distinguish the effect from other effects";
  }
}

/** @param {readonly Visibility[]} rows */
export function visibilityReport(rows) {
  const seen = rows.filter((row) => row.visible).sort((a, b) => b.share - a.share);
  const fitted = rows.filter((row) => !row.visible && row.why === "schedule" && row.share < ABSORBED_SHARE);
  const unseen = rows.filter((row) => !row.visible && !fitted.includes(row));
  return [
    h(
      "p",
      {},
      h("strong", {}, `This plan can detect ${seen.length} of ${rows.length} effects`),
      unseen.length ? ` and cannot detect ${unseen.length}; ` : "; ",
      fitted.length
        ? `${fitted.length} are part of the model that a first fit to this plan's data has, and are fitted.`
        : null,
    ),
    h(
      "ul",
      { class: "detectable-effects", "aria-label": "Effects this plan can detect, with the smallest detectable size" },
      seen.map((row) =>
        h(
          "li",
          { title: `${percent(row.share)} of it is not absorbed by the model of a first fit` },
          effectLink(row),
          h("span", { class: "nowrap" }, smallestSize(row)),
        ),
      ),
    ),
    h(
      "p",
      { class: "muted small" },
      "The number beside each effect is the smallest size that the plan can detect, in the unit of the effect. ppm: millionths of the rate; %: of the full effect. A surface over rate and temperature is a form of a model, not a cause, and is not counted here.",
    ),
    unseen.length
      ? table(
          [
            { title: "Cannot be detected", cell: effectLink },
            {
              title: "Reason, and which experiment would detect it",
              prose: true,
              cell: (row) => [
                h("span", {}, unseenText(row)),
                row.experiment ? h("span", { class: "muted small secondary" }, `Try: ${row.experiment}`) : null,
              ],
            },
          ],
          unseen,
          { label: "Effects this plan cannot detect" },
        )
      : notice("good", "This plan can detect every effect that is not part of the model of a first fit."),
    fitted.length
      ? h(
          "p",
          { class: "muted small" },
          "Already in the model of a first fit, which follows from the axes, rates and temperatures of the plan: ",
          fitted.flatMap((row, k) => (k ? [", ", effectLink(row)] : [effectLink(row)])),
          ".",
        )
      : null,
  ];
}
