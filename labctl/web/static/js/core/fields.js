// Form fields with their labels: selects, inputs, groups of buttons.

import { uniqueId, h } from "./elements.js";

/**
 * A value and its text, for the options of `selectField` and `toggleGroup`.
 * @template {string | number} V
 * @param {V} value
 * @param {string} text
 * @returns {[V, string]}
 */
export const option = (value, text) => [value, text];

/**
 * Labelled select: options are [value, text].
 * @param {string} label
 * @param {readonly (readonly [string | number, string])[]} options
 * @param {string | number | null | undefined} value
 * @param {(value: string) => unknown} onchange
 */
export function selectField(label, options, value, onchange) {
  const id = uniqueId("choice");
  /** @type {HTMLSelectElement} */
  const select = h(
    "select",
    { id, onchange: () => onchange(select.value) },
    options.map(([each, text]) => h("option", { value: each, selected: String(each) === String(value) }, text)),
  );
  return h("div", { class: "field" }, h("label", { for: id }, label), select);
}

/**
 * @param {string} label
 * @param {HTMLElement} input
 * @param {string | null} [hint]
 */
export function labelledField(label, input, hint) {
  const id = uniqueId("field");
  input.id = id;
  if (hint) input.setAttribute("aria-describedby", `${id}-hint`);
  return h(
    "div",
    { class: "field" },
    h("label", { for: id }, label),
    input,
    hint ? h("span", { class: "hint", id: `${id}-hint` }, hint) : null,
  );
}

/**
 * A group of buttons of which one is pressed: options are [value, text].
 * @template {string} Value
 * @param {string} label
 * @param {readonly (readonly [Value, string, ...unknown[]])[]} options
 * @param {string} value
 * @param {(value: Value) => unknown} onchange
 */
export function toggleGroup(label, options, value, onchange) {
  const buttons = options.map(([each, text]) =>
    h(
      "button",
      {
        type: "button",
        "aria-pressed": String(each === value),
        onclick: () => {
          buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(options[k][0] === each)));
          onchange(each);
        },
      },
      text,
    ),
  );
  return h("div", { class: "tabs", role: "group", "aria-label": label }, buttons);
}

/**
 * A message about a request that names each field of a form as the form does, without a full stop at its end.
 * @param {string} message such as "body.due_days: ..."
 * @param {readonly { name: string, label: string }[]} fields
 */
export const inLabels = (message, fields) =>
  message
    .replace(/\bbody\.(\w+): /g, (path, name) => {
      const field = fields.find((each) => each.name === name);
      return field ? `${field.label}: ` : path;
    })
    .replace(/\.$/, "");
