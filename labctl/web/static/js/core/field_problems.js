// What is wrong with the entries of a form, in words beside each field.

import { h, uniqueId } from "./elements.js";

/** @import { Answers } from "../../../types/pages.js" */

/**
 * The entries of a form; of a checkbox "on" or "".
 * @param {HTMLFormElement} form
 * @returns {Answers}
 */
export const entriesOf = (form) =>
  Object.fromEntries(
    [...form.querySelectorAll("input")].map((input) => [
      input.name,
      input.type === "checkbox" && !input.checked ? "" : input.value,
    ]),
  );

/**
 * Mark the fields that have to be corrected, and take the marks of before away; the first one is focused.
 * @param {HTMLFormElement} form
 * @param {Record<string, string>} problems name of the field -> words
 */
export function markProblems(form, problems) {
  for (const mark of form.querySelectorAll(".field-problem")) mark.remove();
  /** @type {HTMLInputElement | undefined} */
  let first;
  for (const input of form.querySelectorAll("input")) {
    const words = problems[input.name];
    input.removeAttribute("aria-invalid");
    input.removeAttribute("aria-errormessage");
    if (!words) continue;
    const id = uniqueId("problem");
    input.setAttribute("aria-invalid", "true");
    input.setAttribute("aria-errormessage", id);
    input.after(h("span", { class: "field-problem", id, role: "alert" }, words));
    first ??= input;
  }
  first?.focus();
}
