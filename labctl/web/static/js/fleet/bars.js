// Bars of one length scale with their numbers beside: a small picture that is also a list.

import { h } from "../core/elements.js";
import { count } from "../core/format.js";

/** @typedef {{ name: string, units: number, kind?: "good" | "warn" | "bad" | "" }} Bar */

/**
 * A list of bars; the longest has the whole width.
 * @param {string} title
 * @param {readonly Bar[]} bars
 * @param {string} nothing what is said where there is none
 */
export function bars(title, bars, nothing) {
  const most = Math.max(1, ...bars.map(({ units }) => units));
  return h(
    "div",
    { class: "stack small-multiple" },
    h("h3", {}, title),
    bars.length
      ? h(
          "ul",
          { class: "bars", "aria-label": title },
          bars.map(({ name, units, kind = "" }) =>
            h(
              "li",
              {},
              h("span", { class: "bar-name" }, name),
              h(
                "span",
                { class: "bar-space", "aria-hidden": "true" },
                units ? h("span", { class: `bar-length ${kind}`, style: `width: ${(100 * units) / most}%` }) : null,
              ),
              h("span", { class: "bar-count" }, count(units)),
            ),
          ),
        )
      : h("p", { class: "muted" }, nothing),
  );
}
