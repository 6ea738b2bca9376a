// A modal dialog that asks for some values, and sends them where it is told how.

import { inLabels, labelledField } from "./fields.js";
import { setChildren, uniqueId, h } from "./elements.js";
import { capitalised, MAX_PERSON_CHARACTERS } from "./format.js";
import { isAbort, messageOf, Problem } from "./http/errors.js";
import { show, visitSignal } from "./router.js";

/** @import { Answers, Child, Field } from "../../../types/pages.js" */

/** A dialog of more fields than these has them in two columns, where the screen is wide enough. */
const NARROW_FIELDS = 7;

/** The field of the person who acts. @type {Field} */
export const WHO = { name: "by", label: "Who", maxlength: MAX_PERSON_CHARACTERS };

/**
 * What stands below a field: its own hint, or that it may be left empty.
 * @param {Field} field
 */
const hintOf = ({ hint, required, type }) =>
  hint ?? (required === false && type !== "checkbox" ? "Optional." : undefined);

/** @param {Field} field */
const inputOf = (field) =>
  h("input", {
    name: field.name,
    type: field.type ?? "text",
    value: field.type === "checkbox" ? "on" : (field.value ?? ""),
    checked: field.type === "checkbox" && field.value === "on",
    minlength: field.minlength ?? null,
    maxlength: field.maxlength ?? null,
    min: field.min ?? null,
    max: field.max ?? null,
    required: field.required !== false,
    autocomplete: "off",
  });

/** @param {HTMLInputElement} input */
const valueOf = (input) => (input.type === "checkbox" && !input.checked ? "" : input.value);

/**
 * Show a modal dialog until it is closed, or until the page that it was opened on is left.
 * @param {HTMLDialogElement} box
 * @param {AbortSignal} signal of the visit
 */
export function openModal(box, signal) {
  const close = () => box.close();
  signal.addEventListener("abort", close);
  box.addEventListener("close", () => {
    signal.removeEventListener("abort", close);
    box.remove();
  });
  document.body.append(box);
  box.showModal();
}

/**
 * Modal dialog with a form: resolves to {name: value}, or null when cancelled and when the page is left (`signal`). A
 * checkbox resolves to "on" or "". `body`: an element above the fields.
 * With `send` the dialog stays open until that has succeeded: an error is shown in it, beside what was filled in. Its
 * signal is aborted when the dialog is closed. A conflict also shows the page again, because what it shows is old.
 * @param {string} title
 * @param {readonly Field[]} fields
 * @param {{ text?: string | null, body?: Child, confirm?: string, kind?: string, signal?: AbortSignal,
 *   send?: (answers: Answers, signal: AbortSignal) => Promise<unknown> }} [options]
 * @returns {Promise<Answers | null>}
 */
export function dialog(
  title,
  fields,
  { text, body, confirm = "Continue", kind = "primary", signal = visitSignal(), send } = {},
) {
  if (signal.aborted) return Promise.resolve(null);
  const name = uniqueId("dialog");
  const inputs = fields.map(inputOf);
  const trouble = h("div", {});
  const accept = h("button", { class: `button ${kind}`, type: "submit" }, confirm);
  const form = h(
    "form",
    { method: "dialog" },
    h("h2", { id: name }, title),
    text ? h("p", { class: "muted" }, text) : null,
    body ?? null,
    h(
      "div",
      { class: "dialog-fields" },
      fields.map((f, k) => labelledField(f.label, inputs[k], hintOf(f))),
    ),
    trouble,
    h(
      "div",
      { class: "row dialog-actions" },
      h("button", { class: "button quiet", type: "button", onclick: () => box.close() }, "Cancel"),
      accept,
    ),
  );
  /** @type {HTMLDialogElement} */
  const box = h("dialog", { "aria-labelledby": name, class: fields.length > NARROW_FIELDS ? "wide" : "" }, form);
  const closed = new AbortController();
  /** @type {Answers | null} */
  let given = null;
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (accept.disabled) return; // it is being sent
    const answers = Object.fromEntries(inputs.map((input) => [input.name, valueOf(input)]));
    accept.disabled = true;
    accept.classList.add("busy");
    setChildren(trouble);
    try {
      await send?.(answers, closed.signal);
      given = answers;
      box.close();
    } catch (error) {
      if (closed.signal.aborted || isAbort(error)) return;
      setChildren(trouble, refusal(error, fields));
      trouble.scrollIntoView({ block: "nearest" });
      if (error instanceof Problem && error.status === 409) show({ quiet: true });
    } finally {
      accept.disabled = false;
      accept.classList.remove("busy");
    }
  });
  return new Promise((resolve) => {
    box.addEventListener("close", () => {
      closed.abort();
      resolve(signal.aborted ? null : given);
    });
    openModal(box, signal);
    inputs[0]?.focus();
  });
}

/**
 * @param {unknown} error
 * @param {readonly Field[]} fields
 */
const refusal = (error, fields) =>
  h("div", { class: "notice bad", role: "alert" }, h("p", {}, capitalised(`${inLabels(messageOf(error), fields)}.`)));
