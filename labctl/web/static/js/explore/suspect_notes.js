// What stands beside the suspected effects: why none is named, formulas, experiments, what cannot be tested.

import { h } from "../core/elements.js";
import { inWords, number, probabilityText, idText, sizeText } from "../core/format.js";
import { button, notice } from "../core/components.js";
import { planAddress } from "../core/routes.js";
import { channelName } from "../recordings/channels.js";
import { sharedReasons } from "./experiment_reasons.js";
import { heldOutName } from "./first_models.js";

/** @import { Criticism } from "../../../types/api.js" */
/** @import { ExploreState } from "./state.js" */

/** So many experiments are listed, the best first. */
const EXPERIMENTS_SHOWN = 3;
/** A smaller probability that an experiment names a wrong cause is not worth a word. */
const MIN_WRONG = 0.005;

/**
 * Why an adequate model has suspects and names none of them.
 * @param {Pick<Criticism, "why_not_named" | "suspects">} criticism
 */
export function whyNoneIsNamed({ why_not_named: why, suspects }) {
  const alone = "The odds are those of each effect added alone; how many effects were tried is not counted in them.";
  const unphysical = suspects.some((each) => each.physical === false && each.log_bayes_factor > 0)
    ? " An effect that is not physical for this type of gyro is not named at these odds."
    : "";
  return why
    ? `${alone} ${why}${unphysical}`
    : `${alone} With this number counted, no physical effect is distinguished from noise.${unphysical}`;
}

/**
 * A value with no line break before its uncertainty, nor within its power of ten.
 * @param {string} text
 */
export const unbroken = (text) =>
  text.replaceAll(/ (%|± )|([<>]) /g, (gap) => gap.replaceAll(" ", "\u00a0")).replaceAll("× ", "×\u00a0");

/**
 * Whether a type of gyro usually has an effect of this size, and the range that is usual.
 * @param {string} effect
 * @param {boolean} inside the usual range, by two standard uncertainties
 * @param {readonly number[]} range least and largest first coefficient that is usual, in `unit`
 * @param {string | undefined} unit
 */
export const usualSizeText = (effect, inside, [from, to], unit) => [
  inside
    ? h("span", { class: "good-text" }, "of a usual size")
    : h("span", { class: "bad-text" }, "outside of what is usual"),
  h("span", { class: "muted" }, ` (usual: ${sizeText(from, unit, effect)} to ${sizeText(to, unit, effect)})`),
];

/** @param {Criticism} criticism */
export function aliasNotice(criticism) {
  const group = criticism.suspects.find(
    (s) => s.alias_group.length > 1 && criticism.named.includes(s.effect),
  )?.alias_group;
  if (!group || criticism.verdict !== "ambiguous") return null;
  return notice(
    "warn",
    h("p", {}, h("strong", {}, "This recording cannot distinguish these effects: "), group.map(idText).join(", "), "."),
    h(
      "p",
      {},
      "Adding any one of these effects lowers the error; only another experiment shows which of them is real.",
    ),
  );
}

/**
 * Formulas that describe what no effect explains; each can be tried as a change of the model.
 * @param {ExploreState} state
 * @param {(formulas: string[]) => unknown} onlaw
 */
export function lawList({ criticism, axis, motion }, onlaw) {
  const { laws, law_test: test } = criticism;
  if (!laws.length) return null;
  return h(
    "section",
    { class: "stack", "aria-label": "Laws that describe it" },
    h("h3", {}, "Laws that describe it"),
    h(
      "p",
      { class: "muted" },
      "No effect of the catalogue explains this residual. A law says what it follows and names no cause.",
    ),
    laws.map((law) =>
      h(
        "div",
        { class: "notice stack" },
        h("p", {}, h("code", {}, law.equations[axis] ?? Object.values(law.equations)[0]), " deg/s"),
        h(
          "p",
          { class: "muted small" },
          `${probabilityText(law.probability)} among these laws. RMS with it ${number(law.rms_after_dps)} deg/s, ${heldOutName(motion)} ${number(law.heldout_rms_after_dps)} deg/s.`,
        ),
        h(
          "ul",
          { class: "small" },
          law.follows.map((line) => h("li", {}, line)),
        ),
        h(
          "div",
          { class: "row" },
          button("Try this law", () => onlaw(law.formulas), { kind: "tiny" }),
        ),
      ),
    ),
    test ? h("p", {}, `To ${laws.length > 1 ? "distinguish the first two" : "test it"}, ${test.do}.`) : null,
  );
}

/**
 * @param {Criticism} criticism
 * @param {readonly string[]} ids of the effects of the catalogue
 */
export function experimentList(criticism, ids) {
  if (!criticism.experiments.length) return null;
  const experiments = criticism.experiments.slice(0, EXPERIMENTS_SHOWN);
  const { common, own } = sharedReasons(experiments.map(({ why }) => inWords(why, ids)));
  return h(
    "div",
    { class: "stack" },
    h("h3", {}, "Experiments that show most of which effect is real"),
    common ? h("p", { class: "muted small" }, `Of all these: ${common}`) : null,
    experiments.map((each, place) =>
      h(
        "div",
        { class: "notice" },
        h(
          "p",
          {},
          inWords(each.do, ids),
          each.hours ? ` (${number(each.hours, 2)} h)` : "",
          each.names_wrong < MIN_WRONG
            ? ""
            : `; a wrong cause is then named with a probability of ${unbroken(probabilityText(each.names_wrong))}`,
        ),
        own[place] ? h("p", { class: "muted small" }, own[place]) : null,
        each.toml
          ? h(
              "a",
              { class: "button tiny", href: planAddress(each.toml, criticism.serial, criticism.version) },
              "Plan it",
            )
          : null,
      ),
    ),
  );
}

/** @param {Criticism} criticism */
export function untestableEffects(criticism) {
  if (!criticism.not_testable.length) return null;
  /** @param {Criticism["not_testable"][number]} line */
  const why = (line) =>
    line.why === "channel"
      ? `not recorded: ${line.needs.map(channelName).join(", ")}`
      : "this schedule cannot detect the effect";
  return h(
    "details",
    {},
    h("summary", {}, `Effects that this recording cannot test (${criticism.not_testable.length})`),
    h(
      "ul",
      { class: "two-columns" },
      criticism.not_testable.map((line) =>
        h(
          "li",
          {},
          h("a", { href: `/effects/${line.effect}` }, idText(line.effect)),
          h("span", { class: "muted small" }, ` ${why(line)}`),
        ),
      ),
    ),
  );
}
