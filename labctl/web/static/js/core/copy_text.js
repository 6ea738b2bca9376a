// Copy a text: into the clipboard, or where the browser does not allow it (no HTTPS), shown selected to copy by hand.

import { h } from "./elements.js";
import { toast } from "./components.js";
import { openModal } from "./dialog.js";
import { visitSignal } from "./router.js";

/**
 * @param {string} text
 * @param {string} what
 */
export async function copyText(text, what) {
  const signal = visitSignal();
  try {
    await navigator.clipboard.writeText(text);
    toast("good", `${what} copied.`);
  } catch {
    if (!signal.aborted) showToCopy(text, what, signal);
  }
}

/**
 * @param {string} text
 * @param {string} what
 * @param {AbortSignal} signal
 */
function showToCopy(text, what, signal) {
  const area = h("textarea", { rows: "8", "aria-label": what, style: "width: min(80vw, 44rem)" });
  Object.assign(area, { value: text, readOnly: true });
  /** @type {HTMLDialogElement} */
  const dialog = h(
    "dialog",
    { "aria-label": `Copy: ${what}` },
    h("p", {}, `${what}: the browser does not allow this page to copy; press Ctrl+C.`),
    area,
    h("button", { type: "button", class: "button", onclick: () => dialog.close() }, "Close"),
  );
  openModal(dialog, signal);
  area.select();
}
