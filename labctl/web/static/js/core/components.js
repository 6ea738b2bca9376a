// User interface components that several pages use.

import { isAbort, messageOf, Problem, Unreachable } from "./http/errors.js";
import { setChildren, h } from "./elements.js";

/** @import { Child, Column, Fact } from "../../../types/pages.js" */

/**
 * A card with a heading.
 * @param {string} title
 * @param {...Child} children
 */
export function card(title, ...children) {
  return h("section", { class: "card stack", "aria-label": title }, h("h2", {}, title), ...children);
}

/**
 * @param {string} title
 * @param {Child} beside
 * @param {...Child} children
 */
export function cardWithHeader(title, beside, ...children) {
  return h(
    "section",
    { class: "card stack", "aria-label": title },
    h("div", { class: "card-header" }, h("h2", {}, title), beside),
    ...children,
  );
}

/**
 * Header of a page: its h1, a line below, and actions at the right.
 * @param {string} title
 * @param {Child} [line]
 * @param {...Child} acts
 */
export function pageHeader(title, line, ...acts) {
  return h(
    "header",
    { class: "page-header" },
    h("div", {}, h("h1", {}, title), line ? h("p", { class: "muted" }, line) : null),
    acts.length ? h("div", { class: "row" }, ...acts) : null,
  );
}

/**
 * A description list: [name, value, unit, secondary text].
 * @param {readonly (Fact | null)[]} rows
 */
export function factList(rows) {
  return h(
    "dl",
    { class: "facts" },
    rows
      .filter((row) => row !== null)
      .map(([name, value, unit, beside]) =>
        h(
          "div",
          { class: "fact" },
          h("dt", {}, name),
          h(
            "dd",
            {},
            value,
            unit ? [" ", h("span", { class: "unit" }, unit)] : null,
            beside ? h("span", { class: "secondary" }, beside) : null,
          ),
        ),
      ),
  );
}

/**
 * @param {Child} text
 * @param {string} [kind]
 */
export const chip = (text, kind = "") => h("span", { class: `chip ${kind}` }, text);
/**
 * What a service that only reads says in place of its acts; not shown by any other.
 * @param {string} what that is not done here
 */
export const readOnlyNote = (what) =>
  h(
    "p",
    { class: "muted read-only-note" },
    `${what}: this service only reads. Use the service whose address is at the head of the page.`,
  );

/**
 * A model's name, which may break after each part: yang2018+ scale_factor_asymmetry.
 * @param {string | null | undefined} name
 * @returns {Child[]}
 */
export const modelName = (name) => (name ?? "").split(/(?<=\+)/).flatMap((part, k) => (k ? [h("wbr"), part] : [part]));
/**
 * @param {string} kind
 * @param {...Child} children
 */
export const notice = (kind, ...children) =>
  h("div", { class: `notice ${kind}`, role: kind === "bad" ? "alert" : "status" }, ...children);
/**
 * The warnings of a fit or of a change, null without any.
 * @param {{ warnings?: readonly { severity: string, text: string }[] }} answer
 */
export const fitWarnings = (answer) =>
  answer.warnings?.length
    ? notice(
        "bad",
        answer.warnings.map((each) => h("p", {}, `${each.severity === "certain" ? "Wrong" : "Check"}: ${each.text}`)),
      )
    : null;
/**
 * A sentence whose commands stand between backticks.
 * @param {string} text
 */
export const withCommands = (text) => text.split("`").map((part, k) => (k % 2 ? h("code", {}, part) : part));
/** @param {...Child} children */
export const emptyState = (...children) => h("div", { class: "empty stack" }, ...children);
/** @param {string} text */
export const busyIndicator = (text) => h("p", { class: "busy muted", role: "status" }, text);

/** @param {{ number?: boolean, prose?: boolean, acts?: boolean }} column */
const kindOf = ({ number, prose, acts }) => (number ? "number" : prose ? "prose" : acts ? "acts" : null);

/**
 * A table: columns are {title, number?, prose?, acts?, cell(row)}, each with a title: a screen reader says it with every
 * cell. One that `acts` has buttons alone, and is not printed.
 * On a phone its rows become cards, unless they are `dense`.
 * @template Row
 * @param {readonly (Column<Row> | null)[]} columns
 * @param {readonly Row[]} rows
 * @param {{ label?: string, selected?: (row: Row) => unknown, onrow?: (row: Row) => unknown, first?: string, dense?: boolean }} [options]
 */
export function table(columns, rows, { label, selected, onrow, first, dense } = {}) {
  const shown = columns.filter((column) => column !== null);
  return h(
    "div",
    { class: "table-scroll", tabindex: "0", role: "group", "aria-label": label },
    h(
      "table",
      { class: dense ? "data" : "data cards", style: first ? `--first-column: ${first}` : null },
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          shown.map((c) => h("th", { class: kindOf(c), scope: "col" }, c.title)),
        ),
      ),
      h(
        "tbody",
        {},
        rows.map((row) =>
          h(
            "tr",
            { "aria-selected": selected?.(row) ? "true" : null, onclick: onrow ? () => onrow(row) : null },
            shown.map((c) => {
              const content = c.cell(row);
              return h(
                "td",
                {
                  class: kindOf(c),
                  "data-title": typeof c.title === "string" && c.title ? c.title : null,
                  "data-blank": content === "–" ? "yes" : null, // on a card, a line that says nothing is left out
                },
                h("div", {}, content),
              );
            }),
          ),
        ),
      ),
    ),
  );
}

/**
 * A button with an asynchronous action: disabled and marked busy until the action ends.
 * @param {Child} text
 * @param {() => unknown} act
 * @param {{ kind?: string, done?: string }} [options]
 */
export function button(text, act, { kind = "", done } = {}) {
  const element = h(
    "button",
    {
      type: "button",
      class: `button ${kind}`,
      onclick: async () => {
        element.disabled = true;
        element.classList.add("busy");
        try {
          await act();
          if (done) toast("good", done);
        } catch (error) {
          if (!isAbort(error)) toast("bad", messageOf(error));
        } finally {
          element.disabled = false;
          element.classList.remove("busy");
        }
      },
    },
    text,
  );
  return element;
}

/**
 * A button that changes something: not shown by a service that only reads.
 * @type {typeof button}
 */
export const actButton = (text, act, options = {}) =>
  button(text, act, { ...options, kind: `act ${options.kind ?? ""}`.trim() });

/**
 * Error page: title, message, and a button to try again.
 * @param {unknown} error
 * @param {() => unknown} [again]
 */
export function errorPage(error, again) {
  const what =
    error instanceof Problem
      ? error.title
      : error instanceof Unreachable
        ? "No answer"
        : "This page has failed; reload it";
  if (!(error instanceof Problem || error instanceof Unreachable)) console.error(error);
  return h(
    "div",
    { class: "page" },
    h("h1", {}, what),
    notice("bad", h("p", {}, withCommands(messageOf(error)))),
    h("div", { class: "row" }, isMissing(error) ? waysOut(location) : again ? tryAgain(again) : null),
  );
}

/** @param {unknown} error */
export const isMissing = (error) => error instanceof Problem && error.status === 404;

/** @param {() => unknown} again */
const tryAgain = (again) => h("button", { class: "button", type: "button", onclick: again }, "Try again");

/**
 * Links from the page of something that does not exist, which no second attempt shows.
 * @param {{ pathname: string, search: string }} place
 */
function waysOut({ pathname, search }) {
  const unit = new URLSearchParams(search).get("unit");
  const list = /^\/(campaigns|recordings)\//.exec(pathname)?.[1] ?? "units";
  return [
    unit ? h("a", { class: "button", href: `/units/${encodeURIComponent(unit)}` }, `Versions of ${unit}`) : null,
    h("a", { class: "button", href: `/${list}` }, `All ${list}`),
  ];
}

/**
 * Show a toast; an error, and what `stays`, is shown until it is closed.
 * @param {string} kind
 * @param {string} text
 * @param {{ stays?: boolean }} [options]
 */
export function toast(kind, text, { stays = kind === "bad" } = {}) {
  const corner = document.querySelector(".toasts");
  if (!corner) return;
  const element = notice(
    kind,
    h("span", {}, text),
    h(
      "button",
      { class: "button quiet tiny", type: "button", "aria-label": "Close", onclick: () => element.remove() },
      "✕",
    ),
  );
  corner.append(element);
  if (!stays) setTimeout(() => element.remove(), 6000);
}

/**
 * Show a busy indicator in `place`, then the element that `make()` resolves to, or its error.
 * @template {Element} E
 * @param {E} place
 * @param {string} text
 * @param {() => Child | Promise<Child>} make
 */
export async function loadInto(place, text, make) {
  setChildren(place, busyIndicator(text));
  try {
    setChildren(place, await make());
  } catch (error) {
    if (!isAbort(error)) setChildren(place, notice("bad", messageOf(error)));
  }
  return place;
}
