// A modal dialog that asks for some values, and sends them where it is told how.

import { withCommands } from "./components.js";
import { entriesOf, markProblems } from "./field_problems.js";
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
 * What is wrong with the entries: words for the whole, and those beside fields, by name.
 * @typedef {{ text: string, problems?: Record<string, string> }} Refusal
 */

/**
 * Modal dialog with a form: resolves to {name: value}, or null when cancelled and when the page is left (`signal`). A
 * checkbox resolves to "on" or "". `body`: an element above the fields.
 * Entries that `check` finds wrong are marked, and nothing is sent. With `send` the dialog stays open until that has
 * succeeded: an error is shown in it, as `refused` says it, beside what was filled in. The signal of `send` is aborted
 * when the dialog is closed. A conflict also shows the page again, because what it shows is old. `onclose` is given the
 * entries however the dialog ends.
 * @param {string} title
 * @param {readonly Field[]} fields
 * @param {{ text?: string | null, body?: Child, confirm?: string, kind?: string, signal?: AbortSignal,
 *   check?: (answers: Answers) => Record<string, string>,
 *   send?: (answers: Answers, signal: AbortSignal) => Promise<unknown>,
 *   refused?: (error: unknown) => Refusal, onclose?: (answers: Answers) => void }} [options]
 * @returns {Promise<Answers | null>}
 */
export function dialog(
  title,
  fields,
  {
    text,
    body,
    confirm = "Continue",
    kind = "primary",
    signal = visitSignal(),
    check = () => ({}),
    send,
    refused = (error) => ({ text: capitalised(`${inLabels(messageOf(error), fields)}.`) }),
    onclose,
  } = {},
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
    const answers = entriesOf(form);
    const problems = check(answers);
    markProblems(form, problems);
    setChildren(trouble);
    if (Object.keys(problems).length) return;
    accept.disabled = true;
    accept.classList.add("busy");
    try {
      await send?.(answers, closed.signal);
      given = answers;
      box.close();
    } catch (error) {
      if (closed.signal.aborted || isAbort(error)) return;
      const said = refused(error);
      setChildren(trouble, h("div", { class: "notice bad", role: "alert" }, h("p", {}, withCommands(said.text))));
      trouble.scrollIntoView({ block: "nearest" });
      markProblems(form, said.problems ?? {});
      if (error instanceof Problem && error.status === 409) show({ quiet: true });
    } finally {
      accept.disabled = false;
      accept.classList.remove("busy");
    }
  });
  return new Promise((resolve) => {
    box.addEventListener("close", () => {
      closed.abort();
      onclose?.(entriesOf(form));
      resolve(signal.aborted ? null : given);
    });
    openModal(box, signal);
    inputs[0]?.focus();
  });
}
