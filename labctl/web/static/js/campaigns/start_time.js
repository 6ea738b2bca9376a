// Start time of a scheduled campaign: in its own time zone, and in the browser's where that differs.

import { h } from "../core/elements.js";
import { instant } from "../core/format.js";

/** @import { Scheduled } from "../../../types/api.js" */

/** @type {Intl.DateTimeFormatOptions} */
const TIME_FORMAT = { weekday: "short", day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" };

/** @param {Pick<Scheduled, "due_at" | "time_zone">} row */
export function startTime(row) {
  if (!row.due_at) return "–";
  const there = new Date(row.due_at).toLocaleString("en-GB", { ...TIME_FORMAT, timeZone: row.time_zone });
  const here = instant(row.due_at);
  return h(
    "span",
    {},
    h("strong", { class: "nowrap" }, there),
    h("span", { class: "muted small secondary" }, row.time_zone, there === here ? null : `; ${here} where you are`),
  );
}
