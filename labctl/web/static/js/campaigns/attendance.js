// When a plan needs a person at the bench, with a warning of times at night and a better start.

import { h } from "../core/elements.js";
import { notice } from "../core/components.js";

/** @import { Attendance } from "../../../types/api.js" */

/**
 * `propose(attendance)` is called for the better start; without it no button is shown. Null: no person is needed.
 * @param {Attendance | null} attendance
 * @param {(attendance: Attendance) => unknown} [propose]
 */
export function attendanceNotice(attendance, propose) {
  if (!attendance) return null;
  const better =
    attendance.better_start && propose
      ? h(
          "button",
          { type: "button", class: "button tiny", onclick: () => propose(attendance) },
          `Begin at ${wallText(attendance.better_start).replace("T", " ")} instead`,
        )
      : null;
  return notice(
    attendance.warning ? "warn" : "",
    h("p", {}, `It ${attendance.text}.`),
    attendance.warning ? h("p", {}, h("strong", {}, "At night: "), `${attendance.warning}.`) : null,
    better,
  );
}

/**
 * An instant with its offset as the wall clock there shows it: 2026-03-28T07:15.
 * @param {string} text
 */
export const wallText = (text) => text.slice(0, 16);
