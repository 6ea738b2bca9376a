// The card of what is new: each row with a small picture, one sentence and one button.

import { setChildren, h } from "../core/elements.js";
import { number, percent } from "../core/format.js";
import { card, chip } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { newsOf, SPANS } from "./news.js";

/** @import { News, Span } from "./news.js" */

const KEPT = "labctl.news.span";
/** Campaigns that are looked through: those of the last days, the running one among them. */
export const NEWEST = 50;
/** Rows that are shown at first. */
const SHOWN = 12;
/** The error over the noise floor at which its bar is full; its length is the logarithm. */
const FULL_RATIO = 100;
const WORDS = { bad: "failed", warn: "decide", accent: "running", good: "done" };

/** @returns {Span} */
const keptSpan = () => {
  const kept = localStorage.getItem(KEPT) ?? "";
  return kept in SPANS ? /** @type {Span} */ (kept) : "evening";
};

/** @param {Parameters<typeof newsOf>[0]} found */
export function newsCard(found) {
  const list = h("div", { class: "stack" });
  /** @param {Span} span */
  const show = (span, all = false) => {
    const rows = newsOf(found, span, new Date());
    const shown = all ? rows : rows.slice(0, SHOWN);
    setChildren(
      list,
      found.campaigns.length >= NEWEST
        ? h("p", { class: "muted small" }, `Of the newest ${NEWEST} campaigns; the others are on the page Campaigns.`)
        : null,
      rows.length
        ? h("ul", { class: "news plain", "aria-label": SPANS[span] }, shown.map(newsRow))
        : h(
            "p",
            { class: "muted" },
            "No version was made, certified or revoked, no campaign has ended, failed or waits for a person, and no start was missed.",
          ),
      shown.length < rows.length
        ? h(
            "button",
            { type: "button", class: "button tiny", onclick: () => show(span, true) },
            `${shown.length} of ${rows.length} are shown; show all`,
          )
        : null,
    );
  };
  const choice = selectField(
    "Show",
    Object.entries(SPANS).map(([value, text]) => option(value, text)),
    keptSpan(),
    (value) => {
      localStorage.setItem(KEPT, value);
      show(/** @type {Span} */ (value));
    },
  );
  show(keptSpan());
  return card("What is new", choice, list);
}

/** @param {News} news */
function newsRow(news) {
  return h(
    "li",
    { class: "news-row" },
    chip(WORDS[news.kind], news.kind),
    thumbnail(news),
    h("p", { class: "news-text" }, h("strong", {}, news.about), ` ${news.text}`),
    h("a", { class: `button tiny ${news.kind === "bad" ? "primary" : ""}`, href: news.href }, news.act),
  );
}

/**
 * How far a campaign came, or how far the error of a draft is above the noise; nothing for other rows.
 * @param {News} news
 */
function thumbnail({ share, over_floor, kind }) {
  const filled =
    share ?? (over_floor === null ? null : Math.min(Math.log(Math.max(over_floor, 1)) / Math.log(FULL_RATIO), 1));
  if (filled === null) return h("span", { class: "news-thumbnail" });
  const words = share === null ? `error ${number(over_floor, 2)} times the noise floor` : `${percent(share)} done`;
  return h(
    "span",
    { class: `news-thumbnail meter ${kind}`, role: "img", "aria-label": words, title: words },
    h("i", { style: `width: ${100 * filled}%` }),
  );
}
