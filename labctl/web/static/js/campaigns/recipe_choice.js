// Recipe choice: a recipe shipped with labctl, or the user's own as TOML.

import { setChildren, uniqueId, h } from "../core/elements.js";
import { count, duration } from "../core/format.js";
import { card, chip } from "../core/components.js";
import { labelledField } from "../core/fields.js";

/** @import { Recipe } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */

/** @typedef {{ name: string, text: string | null }} Choice */

const TYPING_PAUSE_MS = 600;

/**
 * `choice` is {name, text}: `name` "own" means `text`. `chosen(choice)` is called on each change.
 * @param {readonly Recipe[]} all
 * @param {Choice} choice
 * @param {(choice: Choice) => unknown} chosen
 */
export function recipeChoice(all, choice, chosen) {
  const group = uniqueId("recipe");
  /** @type {HTMLTextAreaElement} */
  const text = h("textarea", {
    rows: "16",
    spellcheck: "false",
    value: choice.text ?? "",
    oninput: () => {
      clearTimeout(waiting);
      waiting = setTimeout(() => chosen({ name: "own", text: text.value }), TYPING_PAUSE_MS);
    },
  });
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let waiting;
  const own = h(
    "div",
    {},
    labelledField(
      "Recipe as TOML",
      text,
      "The plan is computed again as you type. Nothing moves before you start the campaign.",
    ),
  );
  const shippedText = h("pre", { class: "command" });
  const shipped = h("details", {}, h("summary", {}, "Recipe text"), shippedText);
  const edit = h(
    "button",
    {
      type: "button",
      class: "button tiny",
      onclick: () => {
        text.value = shippedText.textContent;
        all.length && pick("own");
        for (const [name, radio] of radios) radio.checked = name === "own";
        text.focus();
      },
    },
    "Change a copy of it",
  );
  shipped.append(h("div", { class: "row", style: "margin-top: .5rem" }, edit));
  /** @type {Map<string, HTMLInputElement>} */
  const radios = new Map();

  /**
   * @param {string} name
   * @param {string} title
   * @param {Child} beside
   * @param {Child} [warning]
   */
  function option(name, title, beside, warning) {
    const input = h("input", {
      type: "radio",
      name: group,
      value: name,
      checked: name === choice.name,
      onchange: () => pick(name),
    });
    radios.set(name, input);
    return h(
      "label",
      { class: "option" },
      input,
      h(
        "span",
        { class: "stack", style: "gap: .1rem" },
        h("strong", {}, title),
        h("span", { class: "muted small" }, beside),
        warning,
      ),
    );
  }
  /** @param {string} name */
  function pick(name) {
    if (name === "own" && !text.value.trim()) text.value = all[0]?.text ?? "";
    show(name);
    chosen(name === "own" ? { name, text: text.value } : { name, text: null });
  }
  /** @param {string} name */
  function show(name) {
    own.hidden = name !== "own";
    shipped.hidden = name === "own";
    setChildren(shippedText, all.find((each) => each.name === name)?.text ?? "");
  }
  show(choice.name);
  const ownOption = option("own", "Your own recipe", "A recipe as text, below the list.");
  const isOwn = choice.name === "own";
  return card(
    "Recipe",
    h(
      "div",
      { class: "options", role: "radiogroup", "aria-label": "Recipe" },
      isOwn ? ownOption : null, // what is chosen is not at the end of a long list
      all.map((each) =>
        option(
          each.name,
          each.name,
          h(
            "span",
            {},
            `${each.description}. `,
            each.datasets === null
              ? null
              : h(
                  "span",
                  { class: "nowrap" },
                  `${count(each.datasets)} data ${each.datasets === 1 ? "set" : "sets"}, ${duration(each.expected_s)}`,
                ),
          ),
          each.refused
            ? chip("beyond the bench", "warn")
            : each.remark
              ? h("span", { class: "small warn-text" }, each.remark)
              : null,
        ),
      ),
      isOwn ? null : ownOption,
    ),
    shipped,
    own,
  );
}
