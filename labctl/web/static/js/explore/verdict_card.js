// The verdict in words, and the suspected effects with their evidence.

import { scrollTo, setChildren, h } from "../core/elements.js";
import { inWords, withUncertainty, number, oddsText, probabilityText, idText, isNumber } from "../core/format.js";
import { button, chip, factList, fitWarnings, cardWithHeader, notice } from "../core/components.js";
import { equationDetails } from "../effects/equation.js";
import { recordingsText } from "./chosen_recordings.js";
import { axisNames } from "./dataset_rows.js";
import { heldOutName } from "./first_models.js";
import { floorText } from "./noise_floor.js";
import { verdictLines } from "./verdict_lines.js";
import {
  aliasNotice,
  experimentList,
  lawList,
  unbroken,
  untestableEffects,
  usualSizeText,
  whyNoneIsNamed,
} from "./suspect_notes.js";

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
/**
 * An adequate model beside suspects.
 * @type {[title: string, kind: string]}
 */
const NONE_NAMED = ["Adequate: no effect is named", "good"];
/** Evidence at which the meter is full, nats; its length is the logarithm, so that 70 and 20 000 differ. */
const FULL_NATS = 1e5;

/**
 * Why a residual of more than one noise floor can be what noise and drift leave.
 * @param {number} ratio of the residual to the floor
 * @param {number} statistic variance of the residual over that of noise and drift
 */
const twoNoises = (ratio, statistic) =>
  `The noise floor is that of the recording, the same for every model: ${number(ratio, 2)} floors are ${number(ratio ** 2, 2)} times its variance. The ratio ${number(statistic, 2)} compares each data set with its own noise, which may grow with the rate, and with the drift, both as they are estimated beside this model: slow changes that no model follows count as drift there.`;

const DRAW =
  "“Draw” shows the part of the residual that an effect would explain. “Add” previews a model with the effect; nothing is stored before you make a version.";

/**
 * @param {ExploreState} state
 * @param {readonly Effect[]} effects of the catalogue
 */
export function verdictCard(state, effects) {
  const { criticism } = state;
  const [title, kind] = criticism.further.length ? NONE_NAMED : VERDICTS[criticism.verdict];
  const of = new Set(criticism.joint?.text); // stands in the card of the recordings together
  of.add(criticism.why_not_named); // stands beside the suspects
  const ids = effects.map(({ id }) => id);
  const { first, doubts, others } = verdictLines(criticism, of);
  const { error, noise } = criticism;
  const ratio = (error.rms_dps ?? NaN) / (error.noise_floor_dps ?? NaN);
  const ofFloor = Number.isFinite(ratio) ? `${number(ratio, 2)} times the floor` : null;
  const isDirect = isNumber(error.direct_form_rms_dps);
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
    first.map((line) => h("p", { class: "verdict-statement" }, inWords(line, ids))),
    doubts.length
      ? notice(
          "warn",
          doubts.map((line) => h("p", {}, line)),
        )
      : null,
    others.map((line) => h("p", { class: "muted" }, inWords(line, ids))),
    factList([
      isDirect
        ? ["RMS residual of the model as it corrects the output", number(error.direct_form_rms_dps), "deg/s"]
        : null,
      [
        isDirect ? "RMS residual as a law of the true rate" : "RMS residual of the fitted model",
        number(error.rms_dps),
        "deg/s",
        isDirect ? [ofFloor, "effects are compared in this form"].filter(Boolean).join("; ") : ofFloor,
      ],
      error.heldout_rms_dps === null
        ? null
        : [
            `RMS ${heldOutName(state.motion)} of ${isDirect ? "this law" : "the fit"}`,
            number(error.heldout_rms_dps),
            "deg/s",
          ],
      ["Noise floor of a mean", number(error.noise_floor_dps), "deg/s", floorText(error)],
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
    Number.isFinite(ratio) && criticism.lack_of_fit.statistic !== null
      ? h("p", { class: "muted small" }, twoNoises(ratio, criticism.lack_of_fit.statistic))
      : null,
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
  const ids = effects.map(({ id }) => id);
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
            s.fit_refused
              ? h("p", { class: "small" }, `It cannot be added to this model: ${inWords(s.fit_refused, ids)}.`)
              : h(
                  "div",
                  { class: "row tight" },
                  button("Add", () => onadd(s.effect), {
                    kind: `tiny ${s.effect === criticism.next_effect ? "primary" : ""}`,
                  }),
                  draw(s),
                  openWhatIf(s),
                ),
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
              ? h("span", { class: "muted small" }, s.fit_refused ? "cannot be fitted" : "no fit with it was made")
              : [
                  h("span", { class: "number" }, number(s.rms_after_dps)),
                  h("span", { class: "muted small" }, heldOutText(s, state.motion)),
                ],
          ),
          evidenceItem(
            `Coefficient ± U (k = 2)${axisNames(criticism).length > 1 ? `, axis ${state.axis}` : ""}`,
            coefficientText(s, state.axis),
            usualSize(s, effects),
          ),
          equationDetails(effects, s.effect),
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
    isAdequate
      ? speaking.length
        ? "Suspected effects: none is named"
        : "Suspected effects"
      : "Which effects are missing",
    null,
    isAdequate && speaking.length ? h("p", { class: "muted" }, inWords(whyNoneIsNamed(criticism), ids)) : null,
    speaking.length
      ? [drawnNow, list, open]
      : h(
          "p",
          { class: "muted" },
          "No effect of the catalogue has enough evidence in these data: each explains no more of the error than additional coefficients would explain by chance.",
        ),
    aliasNotice(criticism),
    lawList(state, onlaw),
    experimentList(criticism, ids),
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

/**
 * Whether this type of gyro usually has an effect of this size.
 * @param {Suspect} suspect
 * @param {readonly Effect[]} effects
 */
function usualSize({ effect, plausible, usual_size: inside }, effects) {
  if (!plausible || inside === null) return null;
  const unit = effects.find(({ id }) => id === effect)?.unit;
  return h("div", { class: "small" }, usualSizeText(effect, inside, plausible, unit));
}

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
    .map(([name, { value, u, unit, identified }]) =>
      h(
        "div",
        { class: "small" },
        h("span", { class: "muted" }, `${idText(name)}${identified === undefined ? "" : " (derived)"}`),
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
