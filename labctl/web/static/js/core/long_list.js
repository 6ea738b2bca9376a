// A list that is read in parts: a search over all of it and filters, a table of what was read so far, a button for the
// next part.

import { setChildren, h } from "./elements.js";
import { count } from "./format.js";
import { button, emptyState } from "./components.js";
import { labelledField, option, selectField } from "./fields.js";
import { updateQuery } from "./router.js";

/** @import { Child } from "../../../types/pages.js" */

/** Rows of one part: more than a screen, and drawn in less than a blink. */
export const PART = 100;
const TYPING_MS = 250;

/**
 * @template Row
 * @typedef {object} Part
 * @property {readonly Row[]} rows
 * @property {number} total
 * @property {Record<string, string> | null} next
 */

/**
 * A choice that the list is read with: `name` is that of the query, in the request and in the address of the page.
 * @typedef {object} Filter
 * @property {string} name
 * @property {string} label
 * @property {readonly (readonly [string, string])[]} options [value, text], without the one for all rows
 * @property {string | undefined} value the one at first
 */

/**
 * @template Row
 * @typedef {object} ListOptions
 * @property {string} what the rows in the plural: "units"
 * @property {string} hint what is searched
 * @property {string} [search] what is searched for at first
 * @property {readonly Filter[]} [filters]
 * @property {(query: Record<string, string | number>) => Promise<Part<Row>>} read
 * @property {(rows: readonly Row[]) => Child} draw
 * @property {Child} empty what stands there while there is nothing at all
 */

/**
 * Create the list and read its first part. `element` is the list, `refresh()` reads again what is shown, `rows()` gives it.
 * @template Row
 * @param {ListOptions<Row>} options
 */
export async function longList({ what, hint, search = "", filters = [], read, draw, empty }) {
  /** @type {Record<string, string>} */
  let wanted = { search };
  for (const { name, value, options } of filters)
    if (options.some(([each]) => each === value)) wanted[name] = value ?? "";
  /** @type {Part<Row>} */
  let shown = await read({ ...wanted, limit: PART });
  const table = h("div", {});
  const status = h("p", { class: "muted small", role: "status" });
  const more = button(`Show ${PART} more`, async () => {
    const part = await read({ ...shown.next, ...wanted, limit: PART });
    shown = { ...part, rows: [...shown.rows, ...part.rows] };
    show();
  });
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "search", value: search, maxlength: "200", oninput: () => typed() });
  const field = h(
    "div",
    { class: "row", style: "align-items: flex-start" },
    labelledField(`Search ${what}`, input, hint),
    filters.map(({ name, label, options }) =>
      selectField(label, [option("", `All ${what}`), ...options], wanted[name], (value) => choose(name, value)),
    ),
  );
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let typing;

  function typed() {
    clearTimeout(typing);
    typing = setTimeout(() => choose("search", input.value.trim()), TYPING_MS);
  }

  /**
   * Read the list anew with one choice changed; empty: no longer chosen.
   * @param {string} name
   * @param {string} value
   */
  async function choose(name, value) {
    const { [name]: _, ...others } = wanted;
    const asked = value || name === "search" ? { ...others, [name]: value } : others;
    wanted = asked;
    updateQuery({ [name]: value || null });
    await readPart(PART);
  }

  /** @param {number} limit */
  async function readPart(limit) {
    const asked = wanted;
    const part = await read({ ...asked, limit });
    if (asked !== wanted) return; // chosen anew meanwhile
    shown = part;
    show();
  }

  function show() {
    const { rows, total, next } = shown;
    const chosen = Object.values(wanted).some(Boolean);
    field.hidden = !chosen && next === null && total < PART / 10;
    more.hidden = next === null;
    if (!rows.length) setChildren(table, chosen ? emptyState(h("p", {}, noneOf(what, wanted))) : empty);
    else setChildren(table, draw(rows));
    status.textContent =
      rows.length && (next || chosen)
        ? `${count(rows.length)} of ${count(total)} ${what}${chosen ? " found" : ""}`
        : "";
  }

  const refresh = () => readPart(Math.max(PART, shown.rows.length));

  show();
  return {
    element: h("div", { class: "stack" }, field, table, h("div", { class: "row" }, status, more)),
    refresh,
    rows: () => shown.rows,
    total: () => shown.total,
  };
}

/**
 * @param {string} what
 * @param {Record<string, string>} wanted
 */
const noneOf = (what, { search, ...chosen }) =>
  Object.keys(chosen).length ? `No ${what} are as chosen.` : `No ${what} hold “${search}”.`;
