// Plan a campaign: which recipe, what it would do, what it could find, and when it begins.

import { get, post } from "../core/api.js";
import { fill, h } from "../core/elements.js";
import { count, duration } from "../core/format.js";
import { busy, card, chip, facts, head, notice } from "../core/components.js";
import { remember } from "../core/router.js";
import { begin } from "../campaigns/start_form.js";
import { hiding } from "../campaigns/hidden_effects.js";
import { planPicture } from "../campaigns/plan_chart.js";
import { recipes } from "../campaigns/recipe_choice.js";
import { visibility } from "../campaigns/visibility.js";

export async function page({ query, signal }) {
  const [all, benches, catalogue] = await Promise.all(["/api/recipes", "/api/benches", "/api/effects"].map((path) => get(path, { signal })));
  const bench = benches[0] ?? null;
  const named = all.find((each) => each.name === query.recipe) ?? quickest(all);
  // a recipe of one's own is in the address too: it is short, and so the plan has a link
  const choice = query.toml ? { name: "own", text: query.toml } : { name: named.name, text: null };
  let [clip, hide, asked] = [query.clip === "1", [], new AbortController()];
  const [planned, found] = [h("div", { "aria-live": "polite" }), h("div", { class: "stack" })];
  const simulated = !bench || bench.simulated;
  const hider = simulated ? hiding(catalogue.effects, query.hide, (list) => { hide = list; }) : null;
  const source = () => (choice.name === "own" ? `${choice.text.trimEnd()}\n` : choice.name);

  async function plan() {
    asked.abort();
    asked = new AbortController();
    const given = AbortSignal.any([signal, asked.signal]);
    fill(found, busy("Working out what it could find; for a long plan that takes some seconds."));
    try {
      const answer = await post("/api/plans", { recipe: source(), clip }, { signal: given });
      fill(planned, shown(answer, bench));
    } catch (error) {
      if (error.name === "AbortError") return;
      fill(planned, refused(error));
      fill(found, h("p", { class: "soft" }, "There is no plan to look at."));
      return;
    }
    try {
      const answer = await post("/api/plans", { recipe: source(), clip, visibility: true }, { signal: given });
      fill(found, visibility(answer.visibility));
      hider?.sizes(answer.visibility);
    } catch (error) {
      if (error.name !== "AbortError") fill(found, notice("", error.message));
    }
  }
  const clipping = h("label", { class: "row tight" }, h("input", { type: "checkbox", checked: clip, onchange: (event) => {
    clip = event.target.checked;
    remember({ clip: clip ? 1 : null });
    plan();
  } }), h("span", {}, "Leave out what the bench or the unit cannot do"));
  plan();
  return h("div", { class: "page" },
    head("Plan a campaign", bench ? h("span", { class: "row" }, "On bench ", h("strong", {}, bench.name), bench.simulated ? chip("simulated", "accent") : null) : "For the simulated bench that fits the recipe best.",
      h("a", { class: "button first", href: "#begin" }, "Begin …")),
    query.recipe && named.name !== query.recipe && !query.toml ? notice("warn", `No recipe ${query.recipe} comes with labctl; ${named.name} is shown. Its text can be pasted under "Your own".`) : null,
    h("div", { class: "planning" },
      h("div", { class: "stack" }, recipes(all, choice, (next) => {
        Object.assign(choice, next);
        remember({ recipe: next.name === "own" ? null : next.name, toml: next.name === "own" ? next.text : null });
        plan();
      }), h("div", { class: "card" }, clipping)),
      h("div", { class: "page" }, planned,
        card("What it could find", found),
        hider ? card("Hide an effect", h("p", { class: "soft" }, "The simulated unit then has it, and nothing tells: a case to practise on."), hider) : null,
        begin(bench, () => ({ recipe: source(), clip, hide })))));
}

/** The shortest campaign that the bench can do: a first try. */
function quickest(all) {
  const able = all.filter((each) => !each.refused && !each.remark);
  return able.sort((a, b) => a.expected_s - b.expected_s)[0] ?? all[0];
}

function shown(answer, bench) {
  const ends = new Date(Date.now() + 1000 * answer.expected_s);
  return card("What it would do",
    facts([
      ["Data sets", count(answer.datasets), "", `in ${count(answer.steps)} steps`],
      ["Expected time", duration(answer.expected_s), "", "on the bench's own clock"],
      ["Begun now it ends", ends.toLocaleString("en-GB", { weekday: "short", hour: "2-digit", minute: "2-digit" }), "", ends.toLocaleDateString("en-GB", { day: "numeric", month: "short" })],
      answer.bench === bench?.name ? null : ["Bench", answer.bench],
    ]),
    planPicture(`Plan of ${answer.recipe}`, () => ({ timeline: answer.timeline })),
    answer.clipped.length ? notice("warn", h("strong", {}, `${answer.clipped.length} points are left out`), h("details", {}, h("summary", {}, "Which, and why"), h("ul", {}, answer.clipped.map((each) => h("li", { class: "small" }, each))))) : null);
}

const refused = (error) => card("It cannot be done so", notice("bad", h("p", { class: "told" }, error.message)));
