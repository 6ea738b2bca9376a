// Extend the model: preview a changed model, then save it as the next version.

import { post } from "../core/http/api.js";
import { scrollTo, setChildren, h } from "../core/elements.js";
import { capitalised, number, idText } from "../core/format.js";
import { actButton, button, fitWarnings, cardWithHeader, notice, table, toast } from "../core/components.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { navigate, query } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { postFit } from "./accept_warnings.js";
import { unlessTaken } from "./taken_version.js";
import { equationDetails } from "../effects/equation.js";
import { asked, inAddress } from "./chosen_recordings.js";
import { finishLine, keepFor, stepOf, stepOfPreview } from "./finish_line.js";
import { heldOutName } from "./first_models.js";
import { plausibility, relativeChange, residualFigure } from "./preview_result.js";

/** @import { Effect, Preview } from "../../../types/api.js" */
/** @import { ExploreState } from "./state.js" */

/** The step of the tour that a new version comes to. */
const TOUR_STEP = 5;

/** @typedef {{ add: Set<string>, remove: Set<string>, formula: string }} Changed */

/**
 * @param {ExploreState} state
 * @returns {["raw_rms_dps" | "rms_dps" | "heldout_rms_dps" | "noise_floor_dps", string][]}
 */
const errorsOf = ({ motion }) => [
  ["raw_rms_dps", "Without correction"],
  ["rms_dps", "RMS residual"],
  ["heldout_rms_dps", capitalised(heldOutName(motion))],
  ["noise_floor_dps", "Noise floor"],
];

/**
 * Return {element, put(effect)}: `put` adds an effect to the change and previews it.
 * @param {ExploreState} state
 * @param {readonly Effect[]} effects
 */
export function extendModel(state, effects) {
  const path = { serial: state.serial, version: state.version };
  /** @type {Changed} */
  const change = { add: new Set(), remove: new Set(), formula: "" };
  const has = state.calibration.model.effects;
  const chosen = h("div", { class: "row", "aria-live": "polite" });
  const result = h("div", { class: "stack" });
  /** @type {HTMLTextAreaElement} */
  const formula = h("textarea", {
    rows: "2",
    placeholder: "wet_scale: (humidity_pct - 40) * rate_dps",
    oninput: () => {
      change.formula = formula.value.trim();
      stale();
    },
  });
  const pick = selectField(
    "Add an effect",
    [["", "choose one"], ...effects.filter((e) => !has.includes(e.id)).map((e) => option(e.id, idText(e.id)))],
    "",
    (value) => {
      if (value) {
        change.add.add(value);
        show();
      }
    },
  );
  const drop = selectField(
    "Remove an effect",
    [["", "choose one"], ...has.map((id) => option(id, idText(id)))],
    "",
    (value) => {
      if (value) {
        change.remove.add(value);
        show();
      }
    },
  );

  /**
   * @param {Set<string>} set
   * @param {string} id
   * @param {string} sign
   */
  const tag = (set, id, sign) =>
    h(
      "button",
      {
        type: "button",
        class: "chip accent",
        "aria-label": `do not change ${idText(id)}`,
        onclick: () => {
          set.delete(id);
          show();
        },
      },
      `${sign} ${idText(id)} ✕`,
    );
  const body = () => ({
    add: [...change.add],
    remove: [...change.remove],
    formula: change.formula
      ? change.formula
          .split("\n")
          .map((line) => line.trim())
          .filter(Boolean)
      : [],
    ...asked(state),
  });
  const next = Math.max(...state.versions) + 1;
  const isEmpty = () => !change.add.size && !change.remove.size && !change.formula;
  const stale = () => {
    previewing.classList.toggle("primary", !isEmpty()); // nothing to preview, no next step
    setChildren(
      result,
      isEmpty()
        ? h(
            "p",
            { class: "muted small" },
            "Choose the effects to add or remove, or press Add beside a suspected effect.",
          )
        : null,
    );
  };
  const show = () => {
    setChildren(
      chosen,
      [...change.add].map((id) => tag(change.add, id, "+")),
      [...change.remove].map((id) => tag(change.remove, id, "–")),
    );
    stale();
  };

  /** @type {Preview} */
  let previewed;
  async function preview() {
    previewed = await post("/api/units/{serial}/calibrations/{version}/preview", { path, body: body() });
    setChildren(result, shown(previewed));
    previewing.classList.remove("primary"); // now the next step is to make the version
  }
  const previewing = button("Preview", preview);

  /** @param {Preview} found */
  function shown(found) {
    const floor = found.error.noise_floor_dps;
    return [
      table(
        [
          { title: "deg/s", cell: ([, title]) => title },
          { title: `Version ${state.version}`, number: true, cell: ([key]) => number(found.before[key]) },
          { title: "Changed", number: true, cell: ([key]) => h("strong", {}, number(found.error[key])) },
          {
            title: "Change",
            cell: ([key]) =>
              key === "rms_dps" || key === "heldout_rms_dps"
                ? relativeChange(found.before[key], found.error[key])
                : null,
          },
        ],
        errorsOf(state).filter(([key]) => found.before[key] !== null || found.error[key] !== null),
        { label: "Errors before and after" },
      ),
      fitWarnings(found),
      plausibility(state, found, change, effects),
      found.left_out.length
        ? notice(
            "",
            `Fitted, but not exported with the calibration: ${found.left_out.map((line) => `${idText(line.effect)} (${line.origin ?? "bench"})`).join(", ")}.`,
          )
        : null,
      h(
        "div",
        { class: "row" },
        actButton(`Make version ${next}`, make, { kind: "primary" }),
        h(
          "span",
          { class: "muted small" },
          "This is a preview; nothing is stored yet. Existing versions never change: Make version adds a version beside them.",
        ),
      ),
      residualFigure(state, found, floor),
    ];
  }

  /** @param {{ as_version?: number }} as the number that the button promises; none: whatever the next one is */
  const makeAs = (as) =>
    postFit(
      (accepted) =>
        post("/api/units/{serial}/calibrations/{version}/improve", { path, body: { ...body(), ...accepted, ...as } }),
      "Make version anyway",
    );

  async function make() {
    const made = await unlessTaken(state.serial, next, makeAs);
    if (!made) return;
    toast("good", `Version ${made.version} of ${state.serial} was made.`);
    const steps = [stepOf(state), stepOfPreview(state, previewed, made.version)];
    const finish = finishLine(state, steps, `Version ${state.version} to version ${made.version}`);
    keepFor(state.serial, made.version, finish);
    const tour = query().tour ? TOUR_STEP : null;
    const to = { unit: state.serial, version: made.version, ...inAddress(state), axis: state.axis, tour };
    await navigate(`/explore?${changedQuery("", to)}#finish`);
    await finish.play();
  }

  show();
  const element = cardWithHeader(
    "Add it",
    null,
    h(
      "div",
      { class: "row", role: "group", "aria-label": `Effects of version ${state.version}` },
      h("span", { class: "muted small" }, "In the model now:"),
      has.map((id) => equationDetails(effects, id, idText(id)) ?? h("span", { class: "small" }, idText(id))),
    ),
    h(
      "div",
      { class: "columns screen-only", style: "--column-min: 14rem" },
      pick,
      drop,
      labelledField("A formula of your own", formula, "name: expression over channels, one in a line"),
    ),
    chosen,
    h("div", { class: "row" }, previewing),
    result,
  );
  return {
    element,
    /** @param {string} effect */
    put: async (effect) => {
      change.add.add(effect);
      show();
      scrollTo(element);
      await preview();
    },
    /** @param {readonly string[]} formulas */
    putLaw: async (formulas) => {
      change.formula = formulas.join("\n");
      formula.value = change.formula;
      stale();
      scrollTo(element);
      await preview();
    },
  };
}
