// How fresh the page is: asks the service for a sign of life once a second, and says when it was last heard.
// State of the document: data-stale="yes" once nothing was heard for STALE_MS, "paused" while the tab was hidden.

import { h, setChildren } from "../elements.js";
import { accessKey, get } from "../http/api.js";
import { reportStop } from "../stop/overlay.js";
import { setAlarm } from "../tab_mark.js";
import { freshnessWords, readOnlyWords, stalenessOf } from "./state.js";

/** @import { Heartbeat } from "../../../../types/api.js" */
/** @import { Child } from "../../../../types/pages.js" */
/** @import { Heard, Staleness } from "./state.js" */

const ASK_MS = 1000;
/** An answer may take this long; with the time between questions a page is stale less than 5 s after the last answer. */
const PATIENCE_MS = 2500;
const DRAW_MS = 250;
const PATH = "/health/heartbeat";
const STALE = "Stale. ";

const now = () => performance.now();
/**
 * When the last answer came, on both clocks, and what it said of the bench.
 * @type {{ at: number, on: Date, bench_s: number | null } | null}
 */
let answered = null;
let [asking, askedAt, paused, trouble, notStopped] = [false, -ASK_MS, false, "", false];
/** @type {Staleness | null} */
let state = null;
/** @type {string | null} */
let actsAt = null;
/** @type {string | null} */
let askedWith = null;
/** @type {{ text: HTMLElement, announcement: HTMLElement, reading: HTMLElement } | null} */
let line = null;

async function ask() {
  [asking, askedAt] = [true, now()];
  try {
    const response = await fetch(PATH, { cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
    if (!response.ok) return;
    /** @type {Heartbeat} */
    const answer = await response.json();
    answered = { at: now(), on: new Date(), bench_s: answer.read_only ? null : (answer.heard_s ?? null) };
    notStopped = Boolean(answer.not_stopped);
    reportStop(answer.not_stopped);
    showReadOnly(answer);
    window.dispatchEvent(new CustomEvent("labctl:heard"));
  } catch {
    // not heard: the time since the last answer grows
  } finally {
    asking = false;
    paused = document.hidden;
    draw();
  }
}

/** @returns {Heard} */
function known() {
  const service_s = answered === null ? null : (now() - answered.at) / 1000;
  const bench = answered?.bench_s ?? null;
  return {
    service_s,
    open_s: now() / 1000,
    bench_s: bench === null ? null : bench + (service_s ?? 0),
    paused,
    trouble,
    clock: answered?.on.toLocaleTimeString("en-GB") ?? null,
  };
}

/**
 * Say that the service only reads, how old its data are, and where to act.
 * @param {Heartbeat} answer
 */
function showReadOnly(answer) {
  document.documentElement.toggleAttribute("data-read-only", Boolean(answer.read_only));
  const words = readOnlyWords(answer);
  if (answer.read_only && !answer.acts_at) learnAddress();
  const address = answer.acts_at ?? actsAt;
  const shown = `${words} ${address ?? ""}`;
  if (!line || line.reading.dataset.words === shown) return;
  line.reading.dataset.words = shown;
  const there = words && address ? h("a", { href: address }, address) : null;
  setChildren(line.reading, words, there ? [" To change something: ", there, "."] : null);
}

/** Ask once with each key where to act: the sign of life does not say it to those who show no key. */
async function learnAddress() {
  const key = accessKey();
  if (!key || key === askedWith) return;
  askedWith = key;
  const answer = await get("/health").catch(() => null);
  if (answer && "acts_at" in answer) actsAt = answer.acts_at ?? null;
}

/** The service answers, but not with what this page shows: stale, until it is called with nothing. */
export function setTrouble(why = "") {
  trouble = why;
  draw();
}

function draw() {
  if (!line) return;
  const heard = known();
  const found = stalenessOf(heard);
  const { stale, text } = freshnessWords(found, heard);
  if (line.text.textContent !== (stale ? STALE : "") + text)
    setChildren(line.text, stale ? h("strong", {}, STALE) : null, text);
  setAlarm(notStopped ? "NOT STOPPED" : stale ? "Stale" : "", "freshness");
  if (found === state) return;
  const before = state;
  state = found;
  const root = document.documentElement;
  if (found === "no") delete root.dataset.stale;
  else root.dataset.stale = found === "paused" || found === "first" ? found : "yes";
  if (stale) line.announcement.textContent = "The values on this page may be out of date.";
  if (found === "no" && before !== null && before !== "first") {
    line.announcement.textContent = "The service answers again.";
    window.dispatchEvent(new CustomEvent("labctl:fresh"));
  }
}

/** The line at the head of every page. Called once. */
export function freshnessLine() {
  const [text, announcement] = [h("span", {}), h("span", { class: "visually-hidden", role: "status" })];
  const reading = h("p", { class: "read-only", "data-read-only-words": "" });
  line = { text, announcement, reading };
  const tick = () => {
    if (document.hidden) return;
    if (!asking && now() - askedAt >= ASK_MS) ask();
    draw();
  };
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) paused = true;
    else if (!asking) ask();
    draw();
  });
  window.addEventListener("labctl:moved", () => setTrouble());
  setInterval(tick, DRAW_MS);
  tick();
  return h("div", { class: "freshness", "data-freshness": "" }, text, announcement, reading);
}

/**
 * Words about the present that are only shown while the page is fresh; a stale page says instead that it is not known.
 * @param {Child} fresh
 * @param {Child} [stale]
 */
export const presentWords = (fresh, stale = "Not known now: the bench or the service does not answer.") =>
  h(
    "span",
    { class: "present" },
    h("span", { class: "present-fresh" }, fresh),
    h("span", { class: "present-stale" }, stale),
  );
