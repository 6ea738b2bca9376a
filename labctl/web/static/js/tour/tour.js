// A tour of the page Explore in a few steps, each beside the part of the page that it is about. The address says which
// step is shown (`tour=2`), so that one can go on after a reload, or send it.

import { h, scrollTo, setChildren } from "../core/elements.js";
import { query, updateQuery } from "../core/router.js";
import { STEPS } from "./steps.js";

const MARK = "tour-here";

/**
 * Begin at the step of the address, if it has one, in the page that is shown in `page`.
 * @param {Element} page
 * @param {AbortSignal} signal ends the tour when the page is left
 */
export function showTour(page, signal) {
  const asked = Number(query().tour);
  if (!Number.isInteger(asked) || asked < 1 || asked > STEPS.length) return;
  const box = h("section", { class: "tour card stack", "aria-label": "Tour", tabindex: "-1" });
  const unmark = () => page.querySelectorAll(`.${MARK}`).forEach((each) => each.classList.remove(MARK));
  const end = () => {
    unmark();
    box.remove();
    document.removeEventListener("keydown", onkey);
  };
  const close = () => {
    end();
    updateQuery({ tour: null });
  };
  /** @param {KeyboardEvent} event */
  const onkey = (event) => event.key === "Escape" && close();
  /** @param {number} at */
  const show = (at) => {
    const { anchor, title, text } = STEPS[at];
    updateQuery({ tour: at + 1 });
    unmark();
    const part = page.querySelector(anchor);
    part?.classList.add(MARK);
    if (part) scrollTo(part);
    setChildren(
      box,
      h("p", { class: "muted small" }, `Step ${at + 1} of ${STEPS.length}`),
      h("h2", {}, title),
      h("p", {}, text),
      h(
        "div",
        { class: "row" },
        at ? step("Back", () => show(at - 1)) : null,
        at + 1 < STEPS.length ? step("Next", () => show(at + 1), "primary") : step("Done", close, "primary"),
        at + 1 < STEPS.length ? step("End the tour", close, "quiet") : null,
      ),
    );
    box.focus({ preventScroll: true });
  };
  document.addEventListener("keydown", onkey);
  signal.addEventListener("abort", end);
  document.querySelector(".content")?.append(box);
  show(asked - 1);
}

/**
 * @param {string} text
 * @param {() => unknown} act
 * @param {string} [kind]
 */
const step = (text, act, kind = "") =>
  h("button", { type: "button", class: `button tiny ${kind}`, onclick: act }, text);
