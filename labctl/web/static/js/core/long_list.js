// A list that is read in parts: a search over all of it, a table of what was read so far, a button for the next part.

import { setChildren, h } from "./elements.js";
import { count } from "./format.js";
import { button, emptyState } from "./components.js";
import { labelledField } from "./fields.js";
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
 * @template Row
 * @typedef {object} ListOptions
 * @property {string} what the rows in the plural: "units"
 * @property {string} hint what is searched
 * @property {string} [search] what is searched for at first
 * @property {(query: Record<string, string | number>) => Promise<Part<Row>>} read
 * @property {(rows: readonly Row[]) => Child} draw
 * @property {Child} empty what stands there while there is nothing at all
 */

/**
 * Create the list and read its first part. `element` is the list, `refresh()` reads again what is shown, `rows()` gives it.
 * @template Row
 * @param {ListOptions<Row>} options
 */
export async function longList({ what, hint, search = "", read, draw, empty }) {
  /** @type {Part<Row>} */
  let shown = await read({ search, limit: PART });
  let wanted = search;
  const table = h("div", {});
  const status = h("p", { class: "muted small", role: "status" });
  const more = button(`Show ${PART} more`, async () => {
    const part = await read({ ...shown.next, search: wanted, limit: PART });
    shown = { ...part, rows: [...shown.rows, ...part.rows] };
    show();
  });
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "search", value: search, maxlength: "200", oninput: () => typed() });
  const field = labelledField(`Search ${what}`, input, hint);
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let typing;

  function typed() {
    clearTimeout(typing);
    typing = setTimeout(async () => {
      wanted = input.value.trim();
      updateQuery({ search: wanted || null });
      const asked = wanted;
      const part = await read({ search: asked, limit: PART });
      if (asked !== wanted) return; // typed on meanwhile
      shown = part;
      show();
    }, TYPING_MS);
  }

  function show() {
    const { rows, total, next } = shown;
    field.hidden = !wanted && next === null && total < PART / 10;
    more.hidden = next === null;
    if (!rows.length) setChildren(table, wanted ? emptyState(h("p", {}, `No ${what} hold “${wanted}”.`)) : empty);
    else setChildren(table, draw(rows));
    status.textContent =
      next || wanted ? `${count(rows.length)} of ${count(total)} ${what}${wanted ? " found" : ""}` : "";
  }

  async function refresh() {
    const asked = wanted;
    const part = await read({ search: asked, limit: Math.max(PART, shown.rows.length) });
    if (asked !== wanted) return;
    shown = part;
    show();
  }

  show();
  return {
    element: h("div", { class: "stack" }, field, table, h("div", { class: "row" }, status, more)),
    refresh,
    rows: () => shown.rows,
    total: () => shown.total,
  };
}
