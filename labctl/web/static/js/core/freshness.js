// How fresh the page is: asks the service for a sign of life once a second, and says when it was last heard.
// State of the document: data-stale="yes" once nothing was heard for STALE_MS, "paused" while the tab was hidden.

import { h, setChildren } from "./elements.js";

const ASK_MS = 1000;
/** An answer may take this long; with the time between questions a page is stale less than 5 s after the last answer. */
const PATIENCE_MS = 2500;
export const STALE_MS = 4000;
const DRAW_MS = 250;
/** A bench process that was not heard for longer is not known to be what the page shows. */
const BENCH_STALE_S = 3.5;
const PATH = "/health/heartbeat";

const now = () => performance.now();
let [heard, heardAt, bench, asking, askedAt, paused, state] = [null, null, null, false, -ASK_MS, false, null];

const elapsed = () => (heard === null ? null : (now() - heard) / 1000);

async function ask() {
  [asking, askedAt] = [true, now()];
  try {
    const response = await fetch(PATH, { cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
    if (!response.ok) return;
    const answer = await response.json();
    [heard, heardAt] = [now(), new Date()];
    bench = Number.isFinite(answer.heard_s) ? { heard_s: answer.heard_s, at: now() } : null;
    window.dispatchEvent(new CustomEvent("labctl:heard"));
  } catch {
    // not heard: the time since the last answer grows
  } finally {
    asking = false;
    paused = document.hidden;
    draw();
  }
}

/** Seconds since the bench process was heard; null where the service does not say. */
const benchElapsed = () => (bench === null ? null : bench.heard_s + (now() - bench.at) / 1000);

function stateNow() {
  if (paused) return "paused";
  if (heard === null) return now() > STALE_MS ? "yes" : "first";
  if (now() - heard > STALE_MS) return "yes";
  if (trouble) return "trouble";
  return (benchElapsed() ?? 0) > BENCH_STALE_S ? "bench" : "no";
}

const ago = (seconds) => (seconds < 120 ? `${Math.floor(seconds)} s ago` : `${Math.floor(seconds / 60)} min ago`);
const clockText = (instant) => instant.toLocaleTimeString("en-GB");

function words(found) {
  if (found === "first") return ["Asking the service …"];
  if (found === "paused")
    return [
      `Paused while this tab is hidden: the service was last heard ${heardAt ? `at ${clockText(heardAt)}` : "never"}.`,
    ];
  const service = heard === null ? "The service was not heard." : `Service last heard ${ago(elapsed())}.`;
  if (found === "yes")
    return [
      h("strong", {}, "Stale. "),
      `${service} What is shown may no longer be so${heardAt ? `; it is of ${clockText(heardAt)}` : ""}.`,
    ];
  if (found === "trouble")
    return [h("strong", {}, "Stale. "), `The service answers, but not with what this page shows: ${trouble}`];
  const there = benchElapsed();
  if (found === "bench")
    return [
      h("strong", {}, "Stale. "),
      `Bench last heard ${ago(there)}; the service answers. What is shown of the bench may no longer be so.`,
    ];
  return [there === null ? service : `Service last heard ${ago(elapsed())}, bench ${ago(there)}.`];
}

let [text, announcement, trouble] = [null, null, ""];

/** The service answers, but not with what this page shows: stale, until it is called with nothing. */
export function setTrouble(why = "") {
  trouble = why;
  if (text) draw();
}

function draw() {
  const found = stateNow();
  const said = words(found);
  if (text.textContent !== said.map((word) => word.textContent ?? word).join("")) setChildren(text, said);
  if (found === state) return;
  const before = state;
  state = found;
  const root = document.documentElement;
  if (found === "no") delete root.dataset.stale;
  else root.dataset.stale = found === "paused" ? "paused" : found === "first" ? "first" : "yes";
  if (["yes", "bench", "trouble"].includes(found))
    announcement.textContent = "Stale: what is shown may no longer be so.";
  if (found === "no" && before !== null && before !== "first") {
    announcement.textContent = "The service answers again.";
    window.dispatchEvent(new CustomEvent("labctl:fresh"));
  }
}

/** The line at the head of every page. Called once. */
export function freshnessLine() {
  [text, announcement] = [h("span", {}), h("span", { class: "visually-hidden", role: "status" })];
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
  return h("div", { class: "freshness", "data-freshness": "" }, text, announcement);
}

/** Words about the present that are only shown while the page is fresh; a stale page says instead that it is not known. */
export const presentWords = (fresh, stale = "Not known now: the bench or the service is not heard.") =>
  h(
    "span",
    { class: "present" },
    h("span", { class: "present-fresh" }, fresh),
    h("span", { class: "present-stale" }, stale),
  );
