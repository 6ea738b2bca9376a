// A modal dialog that asks for some values.

import { labelledField } from "./fields.js";
import { uniqueId, h } from "./elements.js";

/** @import { Answers, Child, Field } from "../../../types/pages.js" */

/** A dialog of more fields than these has them in two columns, where the screen is wide enough. */
const NARROW_FIELDS = 7;

/**
 * What stands below a field: its own hint, or that it may be left empty.
 * @param {Field} field
 */
const hintOf = ({ hint, required, type }) =>
  hint ?? (required === false && type !== "checkbox" ? "Optional." : undefined);

/**
 * Modal dialog with a form: resolves to {name: value}, or null when cancelled. A checkbox resolves to "on" or "".
 * `body`: an element above the fields.
 * @param {string} title
 * @param {readonly Field[]} fields
 * @param {{ text?: string | null, body?: Child, confirm?: string, kind?: string }} [options]
 * @returns {Promise<Answers | null>}
 */
export function dialog(title, fields, { text, body, confirm = "Continue", kind = "primary" } = {}) {
  return new Promise((resolve) => {
    const inputs = fields.map((f) =>
      h("input", {
        name: f.name,
        type: f.type ?? "text",
        value: f.type === "checkbox" ? "on" : (f.value ?? ""),
        checked: f.type === "checkbox" && f.value === "on",
        minlength: f.minlength ?? null,
        required: f.required !== false,
        autocomplete: "off",
      }),
    );
    const name = uniqueId("dialog");
    /** @type {HTMLDialogElement} */
    const box = h(
      "dialog",
      { "aria-labelledby": name, class: fields.length > NARROW_FIELDS ? "wide" : "" },
      h(
        "form",
        {
          method: "dialog",
          onsubmit: (event) => {
            event.preventDefault();
            box.close("yes");
          },
        },
        h("h2", { id: name }, title),
        text ? h("p", { class: "muted" }, text) : null,
        body ?? null,
        h(
          "div",
          { class: "dialog-fields" },
          fields.map((f, k) => labelledField(f.label, inputs[k], hintOf(f))),
        ),
        h(
          "div",
          { class: "row dialog-actions" },
          h("button", { class: "button quiet", type: "button", onclick: () => box.close() }, "Cancel"),
          h("button", { class: `button ${kind}`, type: "submit" }, confirm),
        ),
      ),
    );
    box.addEventListener("close", () => {
      box.remove();
      resolve(
        box.returnValue === "yes"
          ? Object.fromEntries(
              inputs.map((input) => [input.name, input.type === "checkbox" && !input.checked ? "" : input.value]),
            )
          : null,
      );
    });
    document.body.append(box);
    box.showModal();
    inputs[0]?.focus();
  });
}
