// What follows a version on the page Explore: the next experiment, its certification, and what these data do not show.

import { setChildren, h } from "../core/elements.js";
import { actButton, button, notice } from "../core/components.js";
import { idText } from "../core/format.js";
import { navigate } from "../core/router.js";
import { changedQuery, planAddress } from "../core/routes.js";
import { elsewhere } from "../campaigns/elsewhere.js";
import { inAddress } from "./chosen_recordings.js";
import { verdictLines } from "./verdict_lines.js";

/** @import { Criticism } from "../../../types/api.js" */
/** @import { Given } from "./version_view.js" */

/**
 * Put a version in force, on the page of its unit.
 * @param {Given} given
 */
const certify = async ({ unit: { serial }, calibration: { version } }) => {
  const left = await navigate(`/units/${encodeURIComponent(serial)}?version=${version}`);
  const { askCertification } = await import("../unit/certification.js"); // no weight of a first visit
  await askCertification(serial, version, left);
};

/**
 * The step after a version: the experiment where it is not adequate, in force or not, else its certification, or that it
 * is in force; beside it what an adequate model does not show.
 * @param {Given} given
 * @param {Criticism} criticism
 */
export function nextStep(given, criticism) {
  if (criticism.verdict !== "adequate") return h("div", { class: "row" }, nextExperiment(given, criticism, "")); // the advised effect has the prominent button
  const isInForce = given.unit.certified_version === given.calibration.version;
  return h(
    "div",
    { class: "stack", id: "finish" },
    unknownCauses(criticism),
    h(
      "div",
      { class: "row" },
      isInForce ? null : actButton("Certify: put in force", () => certify(given), { kind: "primary" }),
      h(
        "span",
        { class: "muted" },
        isInForce
          ? "This version is in force: programs that ask for the calibration of this unit get it."
          : "Programs that ask for the calibration of this unit then get this version.",
      ),
      causeExperiments(given, criticism),
    ),
  );
}

/**
 * What the new version has come to, and what can be done next.
 * @param {Given} given
 * @param {Criticism} criticism
 */
export function nextSteps(given, criticism) {
  const isEnd = criticism.verdict === "adequate";
  const { first, doubts } = verdictLines(criticism);
  return [
    notice(
      isEnd ? "good" : "warn",
      first.map((line) => h("p", {}, h("strong", {}, line))),
      doubts.map((line) => h("p", { class: "small" }, line)),
      isEnd
        ? h(
            "p",
            {},
            criticism.why_not_named
              ? "These data say nothing more that can be relied on; see the suspects that are not named."
              : "These data say nothing more: no effect of the catalogue has evidence in them.",
          )
        : null,
      unknownCauses(criticism),
    ),
    h(
      "div",
      { class: "row" },
      actButton("Certify: put in force", () => certify(given), { kind: isEnd ? "primary" : "" }),
      causeExperiments(given, criticism) ?? nextExperiment(given, criticism, isEnd ? "" : "primary"),
    ),
  ];
}

/**
 * A link to the plan of the experiment that is advised, or to the recipes where none is. Without a bench a plan here
 * would be of another, simulated unit: what can be done with the recipe is shown instead.
 * @param {Given} given
 * @param {Criticism} criticism
 * @param {string} kind
 */
function nextExperiment({ unit, hasBench }, { experiments, version }, kind) {
  const plan = experiments.find((each) => each.toml)?.toml;
  if (plan && !hasBench) return recipeToKeep(unit.serial, plan, kind);
  const href = planAddress(plan ?? "", unit.serial, plan ? version : undefined);
  return h("a", { class: `button ${kind}`, href }, plan ? "Next experiment" : "Plan a campaign");
}

/**
 * A button that shows once what can be done with the recipe of an experiment where no bench is.
 * @param {string} serial
 * @param {string} toml
 * @param {string} kind
 */
function recipeToKeep(serial, toml, kind) {
  const opening = button("Next experiment", () => setChildren(place, elsewhere(serial, { toml })), { kind });
  const place = h("div", { style: "flex-basis: 100%", "aria-live": "polite" });
  return [opening, place];
}

/**
 * What an adequate model does not show: which of several effects is the cause.
 * @param {Criticism} criticism
 */
const unknownCauses = ({ undistinguished }) =>
  undistinguished.map(({ effect, others }) =>
    h(
      "p",
      {},
      `The error is corrected; the cause is not known: ${[effect, ...others].map(idText).join(" or ")}. These data cannot distinguish them.`,
    ),
  );

/**
 * A link to the experiments that distinguish the causes of an adequate model: the version before has them, in which the
 * effect was not yet. Null where the cause is known.
 * @param {Given} given
 * @param {Criticism} criticism
 */
function causeExperiments({ unit: { serial }, calibration: { version }, chosen }, { undistinguished }) {
  if (!undistinguished.length) return null;
  const before = undistinguished[0].version;
  const query = changedQuery("", { unit: serial, version: before, ...inAddress(chosen) });
  return h(
    "a",
    {
      class: "button",
      href: `/explore?${query}#learn`,
      title: `They are those of version ${before}, before version ${version}.`,
    },
    "Experiments to distinguish the causes",
  );
}
