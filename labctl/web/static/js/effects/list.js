// The catalogue of effects, grouped by origin, with a text search.

import { setChildren, h } from "../core/elements.js";
import { idText } from "../core/format.js";
import { chip, emptyState, pageHeader } from "../core/components.js";
import { labelledField, option, toggleGroup } from "../core/fields.js";
import { updateQuery } from "../core/router.js";
import { signatureThumbnail } from "./signature_plot.js";
import { CHANNELS, ORIGINS } from "./labels.js";

/** @import { Effect } from "../../../types/api.js" */
/** @typedef {{ title: string, about: string, effects: Effect[] }} Chapter */
/** @import { Query } from "../../../types/pages.js" */

/**
 * @param {readonly Effect[]} all
 * @param {Query} query
 */
export function effectList(all, query) {
  let [asked, origin] = [query.q ?? "", query.origin ?? ""];
  const [place, found] = [h("div", { class: "page" }), h("p", { class: "muted small", "aria-live": "polite" })];
  const texts = new Map(
    all.map((each) => [
      each,
      [each.id, idText(each.id), each.term, each.sentence, each.experiment, ...each.needs].join(" ").toLowerCase(),
    ]),
  );
  function show() {
    const wanted = asked.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = all.filter(
      (each) => (!origin || each.origin === origin) && wanted.every((word) => texts.get(each)?.includes(word)),
    );
    found.textContent = shown.length === all.length ? "" : `${shown.length} of ${all.length}`;
    const chapters = Object.entries(ORIGINS)
      .map(([name, [title, about]]) => ({ title, about, effects: shown.filter((each) => each.origin === name) }))
      .filter(({ effects }) => effects.length);
    setChildren(
      place,
      chapters.length
        ? chapters.map(originSection)
        : emptyState(`No effect matches "${asked}". Search for another word.`),
    );
  }
  /** @type {HTMLInputElement} */
  const input = h("input", {
    type: "search",
    value: asked,
    placeholder: "rate, temperature, gravity ...",
    oninput: () => {
      asked = input.value;
      updateQuery({ q: asked });
      show();
    },
  });
  show();
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Effects",
      `${all.length} physical causes of a gyro's error: what each cause does, its signature, and the experiment that distinguishes it from similar effects.`,
    ),
    h(
      "div",
      { class: "row", style: "align-items: end" },
      h("div", { style: "flex: 0 1 18rem" }, labelledField("Search", input)),
      toggleGroup(
        "Origin",
        [["", "all"], ...Object.entries(ORIGINS).map(([name, [title]]) => option(name, title.toLowerCase()))],
        origin,
        (value) => {
          origin = value;
          updateQuery({ origin });
          show();
        },
      ),
      found,
    ),
    place,
  );
}

/** @param {Chapter} chapter */
const originSection = ({ title, about, effects }) =>
  h(
    "section",
    { class: "stack", "aria-label": title },
    h("div", {}, h("h2", {}, title), h("p", { class: "muted" }, about)),
    h(
      "div",
      { class: "effect-grid" },
      effects.map((effect) =>
        h(
          "a",
          { class: "card effect-card", href: `/effects/${effect.id}` },
          signatureThumbnail(effect.id),
          h(
            "span",
            { class: "effect-card-text" },
            h("strong", {}, effect.term),
            h("span", { class: "muted small" }, effect.sentence),
            h(
              "span",
              { class: "row effect-card-footer" },
              h("code", { class: "muted small" }, effect.id),
              effect.needs.length
                ? chip(`needs ${effect.needs.map((name) => CHANNELS[name] ?? idText(name)).join(", ")}`)
                : null,
            ),
          ),
        ),
      ),
    ),
  );
