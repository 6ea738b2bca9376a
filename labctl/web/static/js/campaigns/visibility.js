// Visibility report: which effects a plan could detect and which not, before anything is measured.

import { h } from "../core/elements.js";
import { capitalised, idText, inWords, percent, sizeText } from "../core/format.js";
import { notice, table } from "../core/components.js";
import { channelName } from "../recordings/channels.js";

/** @import { Criticism, Visibility } from "../../../types/api.js" */

/** Below this share left beside the model, the model absorbs the effect, or the plan does not excite it. */
const ABSORBED_SHARE = 0.02;

/** @param {{ effect: string }} row */
const effectLink = (row) => h("a", { href: `/effects/${row.effect}` }, idText(row.effect));

/**
 * The effect whose size is given; of a polynomial the order, where the model absorbs the lower ones.
 * @param {Visibility} row
 */
const sizedEffect = (row) => [effectLink(row), row.order ? `, order ${row.order}` : null];

/** @param {Visibility} row */
const smallestSize = ({ effect, smallest_size, unit }) => sizeText(smallest_size, unit, effect);

/**
 * Why a plan cannot show an effect.
 * @param {Visibility} row
 * @param {boolean} isBeside whether it is judged with recordings that are there already
 */
function unseenText(row, isBeside) {
  switch (row.why) {
    case "channel":
      return `needs ${row.needs.map(channelName).join(", ")}, which ${isBeside ? "the recordings of the version lack" : "is not logged"}`;
    case "technology":
      return "gyros of this technology do not have it";
    case "size":
      return `not detectable by this plan: the effect would have to be ${smallestSize(row)}, which is more than this type of gyro can have`;
    default:
      return "this schedule does not distinguish the effect from other effects";
  }
}

/**
 * The rows by what the plan says of them. An effect of the model is estimated; one that the model absorbs, or that the
 * plan does not excite, no data of this plan can show.
 * @param {readonly Visibility[]} rows
 */
export function visibilityGroups(rows) {
  const seen = rows.filter((row) => row.visible).sort((a, b) => b.share - a.share);
  const estimated = rows.filter((row) => !row.visible && row.in_model);
  const left = rows.filter((row) => !row.visible && !row.in_model);
  const isAbsorbed = (/** @type {Visibility} */ row) => row.why === "schedule" && row.share < ABSORBED_SHARE;
  return {
    seen,
    estimated,
    absorbed: left.filter(isAbsorbed),
    unseen: left.filter((row) => !isAbsorbed(row)),
  };
}

/**
 * @param {string} before
 * @param {readonly Visibility[]} rows
 */
const listed = (before, rows) =>
  rows.length
    ? h(
        "p",
        { class: "muted small" },
        before,
        rows.flatMap((row, k) => (k ? [", ", effectLink(row)] : [effectLink(row)])),
        ".",
      )
    : null;

/**
 * @param {readonly Visibility[]} rows
 * @param {{ serial: string, version: string } | null} beside the version beside whose model the plan was judged
 */
export function visibilityReport(rows, beside = null) {
  const { seen, estimated, absorbed, unseen } = visibilityGroups(rows);
  const model = beside ? `the model of version ${beside.version}` : "the model of a first fit";
  const [subject, data] = beside
    ? [`With the recordings of ${beside.serial}, version ${beside.version}, this plan`, "these data"]
    : ["This plan", "this plan"];
  return [
    h(
      "p",
      {},
      h("strong", {}, `${subject} can detect ${seen.length} of ${rows.length} effects`),
      unseen.length + absorbed.length ? ` and cannot detect ${unseen.length + absorbed.length}` : "",
      estimated.length ? `; ${estimated.length} are part of ${model}, which estimates them.` : ".",
    ),
    h(
      "ul",
      { class: "detectable-effects", "aria-label": "Effects this plan can detect, with the smallest detectable size" },
      seen.map((row) =>
        h(
          "li",
          { title: `${percent(row.share)} of it is not absorbed by ${model}` },
          h("span", {}, sizedEffect(row)),
          h("span", { class: "nowrap" }, smallestSize(row)),
        ),
      ),
    ),
    h(
      "p",
      { class: "muted small" },
      "The number beside each effect is the smallest size that the plan can detect, in the unit of the effect; of a polynomial whose lower orders the model absorbs, that of the first order that it lacks. ppm: millionths of the rate; %: of the full effect. A surface over rate and temperature is a form of a model, not a cause, and is not counted here.",
    ),
    unseen.length
      ? table(
          [
            { title: "Cannot be detected", cell: effectLink },
            {
              title: "Reason, and which experiment would detect it",
              prose: true,
              cell: (row) => [
                h("span", {}, unseenText(row, beside !== null)),
                row.experiment ? h("span", { class: "muted small secondary" }, `Try: ${row.experiment}`) : null,
              ],
            },
          ],
          unseen,
          { label: "Effects this plan cannot detect" },
        )
      : absorbed.length
        ? null
        : notice("good", `This plan can detect every effect that is not part of ${model}.`),
    listed(`Cannot be detected: ${data} cannot tell them from ${model}, or the plan does not excite them: `, absorbed),
    listed(`Part of ${model}, and estimated by a fit: `, estimated),
  ];
}

/**
 * What an experiment is expected to say of the suspects that it was proposed for; null for another recipe.
 * @param {Criticism} criticism
 * @param {string} toml
 */
export function purposeOf(criticism, toml) {
  const proposed = criticism.experiments.find((each) => each.toml.trim() === toml.trim());
  if (!proposed) return null;
  const ids = criticism.suspects.map(({ effect }) => effect);
  return h(
    "p",
    {},
    h("strong", {}, `Proposed to distinguish ${proposed.separates.map(idText).join(", ")}. `),
    inWords(capitalised(proposed.why), ids),
  );
}
