// One strip for each limit that is watched: reading, limit, distance, age; amber near the limit, red beyond.

import { h, setChildren } from "../core/elements.js";
import { setAlarm } from "../core/tab_mark.js";
import { ageText, alarmText, distanceText, levelOf, limitText, usedShare, valueText } from "./limit_numbers.js";

/** @import { Campaign, WatchedLimit } from "../../../types/api.js" */

const WORDS = { good: "", warn: "near its limit", bad: "BEYOND ITS LIMIT" };

/** @param {WatchedLimit} limit */
function strip(limit) {
  const level = levelOf(limit);
  const share = Math.min(usedShare(limit), 1);
  return h(
    "li",
    { class: `limit-strip ${level}`, "data-kind": limit.kind, "data-device": limit.device },
    h("span", { class: "limit-what" }, h("strong", {}, limit.device), ` ${limit.title}`),
    h("span", { class: "limit-value" }, valueText(limit)),
    h(
      "span",
      { class: "limit-bar", "aria-hidden": "true" },
      h("i", { style: `inline-size: ${(100 * share).toFixed(1)}%` }),
    ),
    h("span", { class: "limit-limit" }, limitText(limit)),
    h("span", { class: "limit-distance" }, distanceText(limit), WORDS[level] ? h("em", {}, ` ${WORDS[level]}`) : null),
    h("span", { class: "limit-age" }, ageText(limit)),
  );
}

/**
 * The strips of a running campaign: `onStatus(now)` shows those of a progress message.
 * @param {AbortSignal} signal of the page
 */
export function limitStrips(signal) {
  const list = h("ul", { class: "plain limit-strips" });
  const none = h("p", { class: "muted small" }, "The first poll of the bench is awaited.");
  const element = h(
    "section",
    { class: "card stack limits", "aria-label": "Limits" },
    h("h2", {}, "Limits"),
    none,
    list,
  );
  /** @param {Campaign} now */
  const onStatus = (now) => {
    const limits = now.limits ?? [];
    none.hidden = limits.length > 0;
    setChildren(list, limits.map(strip));
    setAlarm(alarmText(limits), "limits");
  };
  signal.addEventListener("abort", () => setAlarm("", "limits"));
  return Object.assign(element, { onStatus });
}
