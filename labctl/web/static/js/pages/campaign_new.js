// The page that plans a campaign: recipe, plan, visibility of effects, start.

import { get, post } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { count, duration, percent } from "../core/format.js";
import { busyIndicator, card, chip, factList, pageHeader, notice } from "../core/components.js";
import { navigate, updateQuery } from "../core/router.js";
import { attendanceNotice } from "../campaigns/attendance.js";
import { SIMULATED } from "../campaigns/campaign_time.js";
import { elsewhere } from "../campaigns/elsewhere.js";
import { startForm } from "../campaigns/start_form.js";
import { hiddenEffectForm } from "../campaigns/hidden_effects.js";
import { mountingWorth } from "../campaigns/mounting_worth.js";
import { designerCard } from "../campaigns/designer.js";
import { planChart } from "../campaigns/plan_chart.js";
import { recipeChoice } from "../campaigns/recipe_choice.js";
import { purposeOf, visibilityReport } from "../campaigns/visibility.js";

/** @import { Bench, Plan, Recipe } from "../../../types/api.js" */
/** @import { Choice } from "../campaigns/recipe_choice.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** What is known of turns by hand without walking through the plan. */
const TURNS_TELL =
  "Turns by hand determine bias, scale factor, misalignment and g-sensitivity, but no effect that depends on the rate or on the temperature.";

/**
 * A plan that was made for a unit measures the units that are on the bench, and not that one where it is not there.
 * @param {string | undefined} unit
 * @param {Bench | null} bench
 * @param {{ toml?: string, name?: string }} recipe that is planned
 */
function absentNotice(unit, bench, recipe) {
  if (!unit || bench?.units.some(({ serial }) => serial === unit)) return null;
  if (!bench)
    return elsewhere(unit, {
      ...recipe,
      more: `What is simulated here is another, simulated unit: it says nothing of ${unit}.`,
    });
  const there = bench.units.map(({ serial }) => serial).join(", ") || "no unit";
  return notice(
    "warn",
    h("strong", {}, `This experiment is for ${unit}, which is not on ${bench.name}. `),
    `A campaign started here measures ${there}; to measure ${unit}, write it into the bench file in place of a unit.`,
  );
}

/**
 * What the experiment was proposed for, where it is one that a version's criticism proposes; null elsewhere.
 * @param {{ unit?: string, version?: string }} query
 * @param {string} toml
 * @param {AbortSignal} signal
 */
async function purposeFor({ unit, version }, toml, signal) {
  if (!unit || !version) return null;
  const path = { serial: unit, version: Number(version) };
  try {
    return purposeOf(await get("/api/units/{serial}/calibrations/{version}/criticism", { path, signal }), toml);
  } catch (error) {
    if (isAbort(error)) throw error;
    return null; // the plan is judged without it
  }
}

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const [all, benches, catalogue] = await Promise.all([
    get("/api/recipes", { signal }),
    get("/api/benches", { signal }),
    get("/api/effects", { signal }),
  ]);
  const bench = benches[0] ?? null;
  const named = all.find((each) => each.name === query.recipe) ?? shortestRecipe(all);
  // the user's own recipe is in the address too, so that the plan has a link
  /** @type {Choice} */
  const choice = query.toml ? { name: "own", text: query.toml } : { name: named.name, text: null };
  let [clip, asked] = [query.clip === "1", new AbortController()];
  /** @type {string[]} */
  let hide = [];
  const [planned, found] = [h("div", { "aria-live": "polite" }), h("div", { class: "stack" })];
  const simulated = !bench || bench.simulated;
  const hider = simulated
    ? hiddenEffectForm(catalogue.effects, query.hide, (list) => {
        hide = list;
      })
    : null;
  // an experiment proposed for a version is judged beside its model, with the recordings that it has
  const beside = query.unit && query.version ? { serial: query.unit, version: query.version } : null;
  const judged = beside ? { unit: beside.serial, version: Number(beside.version) } : {};
  const source = () => (choice.name === "own" ? `${(choice.text ?? "").trimEnd()}\n` : choice.name);

  async function plan() {
    asked.abort();
    asked = new AbortController();
    const given = AbortSignal.any([signal, asked.signal]);
    setChildren(
      found,
      busyIndicator(
        "Computing which effects the plan can detect. Every data set counts: a plan of hundreds takes longer.",
      ),
    );
    try {
      const answer = await post("/api/plans", { body: { recipe: source(), clip }, signal: given });
      setChildren(planned, planCard(answer, bench));
      starting.look();
      if (answer.timeline.kind.includes("turn")) {
        setChildren(found, h("p", { class: "muted" }, TURNS_TELL));
        return;
      }
    } catch (error) {
      if (isAbort(error)) return;
      setChildren(planned, refusalCard(error));
      setChildren(found, h("p", { class: "muted" }, "There is no plan to show."));
      return;
    }
    try {
      const [answer, purpose] = await Promise.all([
        post("/api/plans", { body: { recipe: source(), clip, visibility: true, ...judged }, signal: given }),
        purposeFor(query, source(), given),
      ]);
      const visibility = answer.visibility ?? [];
      setChildren(found, purpose, visibilityReport(visibility, beside));
      hider?.sizes(visibility);
    } catch (error) {
      if (!isAbort(error)) setChildren(found, notice("", messageOf(error)));
    }
  }
  /** @type {HTMLInputElement} */
  const clipBox = h("input", {
    type: "checkbox",
    checked: clip,
    onchange: () => {
      clip = clipBox.checked;
      updateQuery({ clip: clip ? 1 : null });
      plan();
    },
  });
  const clipping = h(
    "label",
    { class: "row tight" },
    clipBox,
    h("span", {}, "Leave out points beyond the limits of the bench or the unit"),
  );
  const starting = startForm(bench, () => ({ recipe: source(), clip, hide }));
  plan();
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Plan a campaign",
      bench
        ? h(
            "span",
            { class: "row" },
            "On bench ",
            h("strong", {}, bench.name),
            bench.simulated ? chip("simulated", "accent") : null,
          )
        : "Computed for the simulated bench that suits this recipe best.",
      h("a", { class: "button", href: "#begin" }, "Begin …"),
    ),
    absentNotice(query.unit, bench, query.toml ? { toml: query.toml } : { name: named.name }),
    query.recipe && named.name !== query.recipe && !query.toml
      ? notice(
          "warn",
          `No recipe ${query.recipe} comes with labctl; ${named.name} is shown. Its text can be pasted under "Your own recipe".`,
        )
      : null,
    h(
      "div",
      { class: "planning" },
      h(
        "div",
        { class: "stack" },
        recipeChoice(all, choice, (next) => {
          Object.assign(choice, next);
          updateQuery({ recipe: next.name === "own" ? null : next.name, toml: next.name === "own" ? next.text : null });
          plan();
        }),
        h("div", { class: "card" }, clipping),
      ),
      h(
        "div",
        { class: "page" },
        designerCard(all, source, (text) => navigate(`/campaigns/new?toml=${encodeURIComponent(text)}`), signal),
        planned,
        card("Effects that the plan can detect", found),
        hider
          ? card(
              "Hide an effect",
              h(
                "p",
                { class: "muted" },
                "The simulated unit then has this effect, but no page names it: an exercise in finding effects.",
              ),
              hider,
            )
          : null,
        starting,
      ),
    ),
  );
}

/**
 * The shortest campaign that the bench can run; one of turns by hand where it has no table.
 * @param {readonly Recipe[]} all
 */
function shortestRecipe(all) {
  const able = all.filter((each) => !each.refused && !each.remark);
  return (
    able.sort((a, b) => Number(a.by_hand) - Number(b.by_hand) || (a.expected_s ?? 0) - (b.expected_s ?? 0))[0] ?? all[0]
  );
}

/**
 * @param {Plan} answer
 * @param {Bench | null} bench
 */
function planCard(answer, bench) {
  const ends = new Date(Date.now() + 1000 * answer.expected_s);
  const simulated = !bench || bench.simulated;
  const clock = simulated ? SIMULATED : "on the bench's own clock";
  return card(
    "Steps",
    factList([
      ["Data sets", count(answer.datasets), "", `in ${count(answer.steps)} steps`],
      answer.verification_datasets
        ? [
            "Of them to verify",
            count(answer.verification_datasets),
            "",
            `never fitted, ${percent(answer.verification_s / answer.expected_s)} of the time`,
          ]
        : null,
      ["Expected time", duration(answer.expected_s), "", clock],
      [
        "Begun now it ends",
        ends.toLocaleString("en-GB", { weekday: "short", hour: "2-digit", minute: "2-digit" }),
        "",
        `${ends.toLocaleDateString("en-GB", { day: "numeric", month: "short" })}${simulated ? `, ${SIMULATED}` : ""}`,
      ],
      answer.bench === bench?.name ? null : ["Bench", answer.bench],
      ["Recipe", answer.recipe],
    ]),
    attendanceNotice(answer.attendance),
    mountingWorth(answer.misalignment),
    planChart(`Plan of ${answer.recipe}`, () => ({ timeline: answer.timeline })),
    answer.clipped.length
      ? notice(
          "warn",
          h("strong", {}, `${answer.clipped.length} points are left out`),
          h(
            "details",
            {},
            h("summary", {}, "Which, and why"),
            h(
              "ul",
              {},
              answer.clipped.map((each) => h("li", { class: "small" }, each)),
            ),
          ),
        )
      : null,
  );
}

/** @param {unknown} error */
const refusalCard = (error) =>
  card("This plan cannot be carried out", notice("bad", h("p", { class: "lead" }, messageOf(error))));
