// Learn: the verdict in words, and what may be missing, with its evidence.

import { fill, h } from "../core/elements.js";
import { measured, number, percent, words } from "../core/format.js";
import { button, chip, facts, headed, notice } from "../core/components.js";
import { axesOf } from "./dataset_rows.js";

const FORMS = {
  adequate: ["Nothing is missing", "good"],
  missing: ["Missing", "warn"],
  ambiguous: ["Cannot tell which", "warn"],
  unexplained: ["Unexplained", "warn"],
  insufficient_data: ["Too little data", "bad"],
};
/** More evidence than this, in nats, looks the same: it is beyond doubt. */
const SURE = 40;

export function verdict(state) {
  const { criticism } = state;
  const [title, kind] = FORMS[criticism.verdict];
  const [first, ...others] = criticism.text;
  const { error, noise } = criticism;
  const ratio = error.rms_dps / error.noise_floor_dps;
  return h("section", { class: `card stack verdict ${kind}`, "aria-label": "Verdict" },
    h("div", { class: "row" }, chip(title, kind), h("span", { class: "soft small" }, `version ${state.version} held against recording ${state.recording}`)),
    h("p", { class: "said" }, first), others.map((line) => h("p", { class: "soft" }, line)),
    facts([
      ["Left after the fit, RMS", number(error.rms_dps), "deg/s", Number.isFinite(ratio) ? `${number(ratio, 2)} times the floor` : null],
      ["At unseen temperatures", number(error.heldout_rms_dps), "deg/s"],
      ["Noise floor of a mean", number(error.noise_floor_dps), "deg/s"],
      noise.vs_datasheet ? ["Drift", number(noise.drift_dps), "deg/s", `${number(noise.vs_datasheet, 2)} times the data sheet's`] : ["Drift", number(noise.drift_dps), "deg/s"],
      ["Lack of fit", number(criticism.lack_of_fit.statistic), null, chance(criticism.lack_of_fit.p_value)],
    ]));
}

const chance = (p) => (p === null || p === undefined ? null : p < 1e-6 ? "chance below 10⁻⁶" : `chance ${number(p, 2)}`);

export function learn(state, { onadd, explain }) {
  const { criticism } = state;
  const named = new Set(criticism.named);
  const drawnNow = h("p", { class: "soft small", "aria-live": "polite" }, "Draw a suspect over the residual to see what it would explain.");
  const draw = (suspect) => button(state.overlay?.effect === suspect.effect ? "Hide" : "Draw", async () => {
    if (state.overlay?.effect === suspect.effect) return state.draw(null);
    const values = await explain(suspect.effect);
    state.draw({ effect: suspect.effect, name: words(suspect.effect), values });
    return fill(drawnNow, `Diamonds in the pictures above: what ${words(suspect.effect)} would explain of the residual.`);
  }, { kind: "tiny" });
  const speaking = criticism.suspects.filter((s) => s.log_bayes_factor > 0);
  const list = h("ol", { class: "suspects", "aria-label": "Suspects" });
  const fillList = () => fill(list, speaking.map((s) => h("li", { class: "suspect" },
    h("div", { class: "stack", style: "gap: .3rem" },
      h("div", { class: "row tight" }, h("a", { class: "suspect-name", href: `/effects/${s.effect}` }, words(s.effect)), named.has(s.effect) ? chip("named", "warn") : null),
      h("div", { class: "soft small" }, s.explanation),
      h("div", { class: "row tight" }, button("Add", () => onadd(s.effect), { kind: `tiny ${named.has(s.effect) ? "first" : ""}` }), draw(s))),
    told("Evidence", evidence(s.log_bayes_factor)),
    told("Takes off", h("span", { class: "number" }, percent(s.share_removed)), h("span", { class: "soft small" }, "of the excess")),
    told("Error with it, deg/s", h("span", { class: "number" }, number(s.rms_after_dps)), h("span", { class: "soft small" }, `${number(s.heldout_rms_after_dps)} at unseen temperatures`)),
    told(`Coefficient, k = 2${axesOf(criticism).length > 1 ? `, axis ${state.axis}` : ""}`, coefficient(s, state.axis)))));
  fillList();
  state.onchange((what) => {
    fillList();
    if (what === "overlay" && !state.overlay) fill(drawnNow, "Draw a suspect over the residual to see what it would explain.");
  });
  return headed("Learn what is missing", null,
    speaking.length ? [drawnNow, list] : h("p", { class: "soft" }, "No effect of the catalogue speaks for itself here: each would explain less than its coefficients cost."),
    aliases(criticism), experiments(criticism), unseen(criticism));
}

const told = (title, ...children) => h("div", { class: "told-of" }, h("span", { class: "soft small" }, title), ...children);

function evidence(nats) {
  const share = Math.max(0, Math.min(nats / SURE, 1));
  return h("div", { class: "evidence" }, h("span", { class: "number" }, `${nats < 1000 ? nats.toFixed(1) : Math.round(nats)} nats`),
    h("div", { class: "meter", role: "img", "aria-label": `evidence ${nats.toFixed(1)} nats` }, h("i", { style: `width: ${100 * share}%` })));
}

function coefficient(suspect, axis) {
  const own = suspect.coefficients[axis] ?? Object.values(suspect.coefficients)[0] ?? {};
  return Object.entries(own).slice(0, 2).map(([name, { value, u, unit }]) =>
    h("div", { class: "small" }, h("span", { class: "soft" }, words(name)), " ", whole(measured(value, 2 * u, unit))));
}

/** A value that is not parted from its uncertainty and its power; only its unit may go to the next line. */
const whole = (text) => text.replaceAll(/ ([±×]) /g, "\u00a0$1\u00a0");

function aliases(criticism) {
  const group = criticism.suspects.find((s) => s.alias_group.length > 1 && criticism.named.includes(s.effect))?.alias_group;
  if (!group || criticism.verdict !== "ambiguous") return null;
  return notice("warn", h("p", {}, h("strong", {}, "This recording cannot tell them apart: "), group.map(words).join(", "), "."), h("p", {}, "Adding one of them lowers the error whichever is true; only another experiment says which."));
}

function experiments(criticism) {
  if (!criticism.experiments.length) return null;
  return h("div", { class: "stack" }, h("h3", {}, "The experiment that would tell"), criticism.experiments.slice(0, 3).map((each) =>
    h("div", { class: "notice" }, h("p", {}, each.do, each.hours ? ` (${number(each.hours, 2)} h)` : ""),
      h("p", { class: "soft small" }, `Separates ${each.separates.map(words).join(", ")} with a probability of ${percent(each.power)}.`),
      each.toml ? h("a", { class: "button tiny", href: `/campaigns/new?toml=${encodeURIComponent(each.toml)}` }, "Plan it") : null)));
}

function unseen(criticism) {
  if (!criticism.not_testable.length) return null;
  const why = (line) => (line.why === "channel" ? `not recorded: ${line.needs.map(words).join(", ")}` : "this schedule hides it");
  return h("details", {}, h("summary", {}, `What this recording cannot say anything about (${criticism.not_testable.length})`),
    h("ul", { class: "two" }, criticism.not_testable.map((line) => h("li", {}, h("a", { href: `/effects/${line.effect}` }, words(line.effect)), h("span", { class: "soft small" }, ` ${why(line)}`)))));
}
