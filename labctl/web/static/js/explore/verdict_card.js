// The verdict in words, and the suspected effects with their evidence.

import { scrollTo, setChildren, h } from "../core/elements.js";
import { withUncertainty, number, oddsText, probabilityText, idText } from "../core/format.js";
import { button, chip, factList, fitWarnings, cardWithHeader, notice } from "../core/components.js";
import { planAddress } from "../core/routes.js";
import { equationDetails } from "../effects/equation.js";
import { recordingsText } from "./chosen_recordings.js";
import { axisNames } from "./dataset_rows.js";
import { heldOutName } from "./first_models.js";

/** @import { Criticism, Effect, Suspect } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */
/** @import { ExploreState } from "./state.js" */

/** @type {Record<Criticism["verdict"], [title: string, kind: string]>} */
const VERDICTS = {
  adequate: ["Adequate: nothing is missing", "good"],
  missing: ["Effect missing", "warn"],
  ambiguous: ["Cause ambiguous", "warn"],
  unexplained: ["Unexplained", "warn"],
  insufficient_data: ["Too little data", "bad"],
};
/** Evidence at which the meter is full, nats; its length is the logarithm, so that 70 and 20 000 differ. */
const FULL_NATS = 1e5;
/** A smaller probability that an experiment names a wrong cause is not worth a word. */
const MIN_WRONG = 0.005;

const DRAW =
  "“Draw” shows the part of the residual that an effect would explain. “Add” previews a model with the effect; nothing is stored before you make a version.";

/** @param {ExploreState} state */
export function verdictCard(state) {
  const { criticism } = state;
  const [title, kind] = VERDICTS[criticism.verdict];
  const of = new Set(criticism.joint?.text); // stands in the card of the recordings together
  const [first, ...others] = criticism.text.filter((line) => !of.has(line));
  const { error, noise } = criticism;
  const ratio = (error.rms_dps ?? NaN) / (error.noise_floor_dps ?? NaN);
  return h(
    "section",
    { class: `card stack verdict ${kind}`, "aria-label": "Verdict" },
    h(
      "div",
      { class: "row" },
      chip(title, kind),
      h("span", { class: "muted small" }, `version ${state.version} compared with ${recordingsText(state)}`),
    ),
    fitWarnings({ warnings: state.calibration.warnings?.filter((each) => each.what === "worse") }),
    h("p", { class: "verdict-statement" }, first),
    others.map((line) => h("p", { class: "muted" }, line)),
    factList([
      [
        "RMS residual of the fitted model",
        number(error.rms_dps),
        "deg/s",
        Number.isFinite(ratio) ? `${number(ratio, 2)} times the floor` : null,
      ],
      error.heldout_rms_dps === null
        ? null
        : [`RMS ${heldOutName(state.motion)} of the fit`, number(error.heldout_rms_dps), "deg/s"],
      ["Noise floor of a mean", number(error.noise_floor_dps), "deg/s"],
      noise.drift_dps === null
        ? null
        : [
            "Drift",
            number(noise.drift_dps),
            "deg/s",
            noise.vs_datasheet ? `${number(noise.vs_datasheet, 2)} times the data sheet's` : null,
          ],
      criticism.lack_of_fit.statistic === null
        ? null
        : [
            "Residual variance over that of noise and drift",
            number(criticism.lack_of_fit.statistic),
            null,
            chanceText(criticism.lack_of_fit.p_value),
          ],
    ]),
  );
}

/** @param {number | null | undefined} p */
const chanceText = (p) =>
  p === null || p === undefined
    ? null
    : p < 1e-6
      ? "noise alone does not leave this"
      : `noise alone leaves this in ${p < 0.01 ? `${number(100 * p, 2)} %` : probabilityText(p)} of cases`;

/**
 * @param {ExploreState} state
 * @param {readonly Effect[]} effects
 * @param {{ onadd: (effect: string) => unknown, onlaw: (formulas: string[]) => unknown, explain: (effect: string) => Promise<(number | null)[]> }} acts
 */
export function suspectList(state, effects, { onadd, onlaw, explain }) {
  const { criticism } = state;
  const named = new Set(criticism.named);
  const drawnNow = h("p", { class: "muted small", "aria-live": "polite" }, DRAW);
  /** @param {Suspect} suspect */
  const draw = (suspect) =>
    button(
      state.overlay?.effect === suspect.effect ? "Hide" : "Draw",
      async () => {
        if (state.overlay?.effect === suspect.effect) return state.setOverlay(null);
        const values = await explain(suspect.effect);
        state.setOverlay({ effect: suspect.effect, name: idText(suspect.effect), values });
        return setChildren(
          drawnNow,
          `Diamonds in the figures of `,
          h("a", { href: "#fails" }, "Where the model fails"),
          `: the part of the residual that ${idText(suspect.effect)} would explain.`,
        );
      },
      { kind: "tiny" },
    );
  const speaking = criticism.suspects.filter((s) => s.log_bayes_factor > 0);
  const open = h("div", {});
  /** @param {Suspect} suspect */
  const openWhatIf = (suspect) =>
    button(
      "What if",
      async () => {
        const others = speaking.filter((each) => each !== suspect);
        const [explained, { whatIf }] = await Promise.all([explain(suspect.effect), import("./what_if.js")]);
        const { parameters = [] } = effects.find(({ id }) => id === suspect.effect) ?? {};
        setChildren(open, whatIf({ state, suspect, parameters, others, explained, explain }));
        scrollTo(open, "nearest");
      },
      { kind: "tiny" },
    );
  const list = h("ol", { class: "suspects", "aria-label": "Suspects" });
  const fillList = () =>
    setChildren(
      list,
      speaking.map((s) =>
        h(
          "li",
          { class: "suspect" },
          h(
            "div",
            { class: "stack", style: "gap: .3rem" },
            h(
              "div",
              { class: "row", style: "gap: .2rem .4rem" },
              h("a", { class: "suspect-name", href: `/effects/${s.effect}` }, idText(s.effect)),
              named.has(s.effect) ? chip("likely missing", "warn") : null,
              s.physical !== false ? null : chip("not physical for this type of gyro"),
            ),
            h("div", { class: "muted small" }, s.explanation),
            h(
              "div",
              { class: "row tight" },
              button("Add", () => onadd(s.effect), {
                kind: `tiny ${s.effect === criticism.next_effect ? "primary" : ""}`,
              }),
              draw(s),
              openWhatIf(s),
            ),
            equationDetails(effects, s.effect),
          ),
          evidenceItem("Evidence", evidenceMeter(s.log_bayes_factor)),
          evidenceItem(
            "Explains",
            h("span", { class: "number" }, probabilityText(s.share_removed)),
            h("span", { class: "muted small" }, "of the error above the noise"),
          ),
          evidenceItem(
            "Error with it, deg/s",
            s.rms_after_dps === null
              ? h("span", { class: "muted small" }, "no fit with it was made")
              : [
                  h("span", { class: "number" }, number(s.rms_after_dps)),
                  h("span", { class: "muted small" }, heldOutText(s, state.motion)),
                ],
          ),
          evidenceItem(
            `Coefficient ± U (95.45 %)${axisNames(criticism).length > 1 ? `, axis ${state.axis}` : ""}`,
            coefficientText(s, state.axis),
          ),
        ),
      ),
    );
  fillList();
  state.onchange((what) => {
    fillList();
    if (what === "axis") setChildren(open); // its figures are of the axis that was shown
    if (what === "overlay" && !state.overlay) setChildren(drawnNow, DRAW);
  });
  const isAdequate = criticism.verdict === "adequate";
  return cardWithHeader(
    isAdequate ? "Missing effects: weak hints only" : "Which effects are missing",
    null,
    isAdequate && speaking.length
      ? h(
          "p",
          { class: "muted" },
          "The odds are those of each effect added alone. How many effects were tried is not counted in them; counted, none of these is distinguished from noise.",
        )
      : null,
    speaking.length
      ? [drawnNow, list, open]
      : h(
          "p",
          { class: "muted" },
          "No effect of the catalogue has enough evidence in these data: each explains no more of the error than additional coefficients would explain by chance.",
        ),
    aliasNotice(criticism),
    lawList(state, onlaw),
    experimentList(criticism),
    untestableEffects(criticism),
  );
}

/**
 * @param {string} title
 * @param {...Child} children
 */
const evidenceItem = (title, ...children) =>
  h("div", { class: "suspect-value" }, h("span", { class: "muted small" }, title), ...children);

/**
 * @param {Suspect} suspect
 * @param {ExploreState["motion"]} motion
 */
const heldOutText = ({ heldout_rms_after_dps: heldOut }, motion) =>
  heldOut === null ? "" : `${number(heldOut)} ${heldOutName(motion)}`;

/** @param {number} nats */
function evidenceMeter(nats) {
  const share = Math.max(0, Math.min(Math.log1p(Math.max(nats, 0)) / Math.log1p(FULL_NATS), 1));
  return h(
    "div",
    { class: "evidence" },
    h("span", { class: "number" }, oddsText(nats), h("span", { class: "muted small" }, " odds for it")),
    h(
      "div",
      { class: "meter", role: "img", "aria-label": `odds for it ${oddsText(nats)}, on a logarithmic scale` },
      h("i", { style: `width: ${100 * share}%` }),
    ),
  );
}

/**
 * @param {Suspect} suspect
 * @param {string} axis
 */
function coefficientText(suspect, axis) {
  const own = suspect.coefficients[axis] ?? Object.values(suspect.coefficients)[0] ?? {};
  return Object.entries(own)
    .map(([name, { value, u, unit }]) =>
      h(
        "div",
        { class: "small" },
        h("span", { class: "muted" }, idText(name)),
        " ",
        unbroken(withUncertainty(value, u === null ? null : 2 * u, unit, name)),
      ),
    )
    .concat(
      h(
        "div",
        { class: "muted small" },
        suspect.coefficients_from === "comparison"
          ? "estimated; no fit with this effect was made"
          : "of a fit with this effect",
      ),
    );
}

/**
 * A value with no line break before its uncertainty, nor within its power of ten.
 * @param {string} text
 */
const unbroken = (text) =>
  text.replaceAll(/ (%|± )|([<>]) /g, (gap) => gap.replaceAll(" ", "\u00a0")).replaceAll("× ", "×\u00a0");

/** @param {Criticism} criticism */
function aliasNotice(criticism) {
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
function lawList({ criticism, axis, motion }, onlaw) {
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
    test ? h("p", {}, `To distinguish the first two, ${test.do}.`) : null,
  );
}

/** @param {Criticism} criticism */
function experimentList(criticism) {
  if (!criticism.experiments.length) return null;
  return h(
    "div",
    { class: "stack" },
    h("h3", {}, "Experiments that show most of which effect is real"),
    criticism.experiments
      .slice(0, 3)
      .map((each) =>
        h(
          "div",
          { class: "notice" },
          h(
            "p",
            {},
            each.do,
            each.hours ? ` (${number(each.hours, 2)} h)` : "",
            each.names_wrong < MIN_WRONG
              ? ""
              : `; a wrong cause is then named with a probability of ${unbroken(probabilityText(each.names_wrong))}`,
          ),
          h("p", { class: "muted small" }, each.why),
          each.toml
            ? h("a", { class: "button tiny", href: planAddress(each.toml, criticism.serial) }, "Plan it")
            : null,
        ),
      ),
  );
}

/** @param {Criticism} criticism */
function untestableEffects(criticism) {
  if (!criticism.not_testable.length) return null;
  /** @param {Criticism["not_testable"][number]} line */
  const why = (line) =>
    line.why === "channel"
      ? `not recorded: ${line.needs.map(idText).join(", ")}`
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
