// Client-side router: the address determines what the page shows.

import { setTrouble } from "./freshness/line.js";
import { isAbort, Problem } from "./http/errors.js";
import { waitOf, whenItMayPass } from "./http/recovery.js";
import { framed } from "./page_frame.js";
import { changedQuery, matchRoute, routeOf } from "./routes.js";
import { setPageName } from "./tab_mark.js";

/** @import { Query } from "../../../types/pages.js" */
/** @import { Route } from "./routes.js" */

/** @type {Route[]} */
const routes = [];
let pageAbort = new AbortController();
let visit = new AbortController(); // of the page, until another address is shown; it outlasts a refresh
let navigated = false; // focus moves to the page from the second page on
let shown = ""; // path and query of the page that is shown
const SCROLLED_MS = 150;

/**
 * Register the module of a pattern like `/units/:serial`. A module exports `page(context)`, which returns an element.
 * @param {string} pattern
 * @param {string} name of the page, while it is not there yet
 * @param {Route["load"]} load
 */
export const route = (pattern, name, load) => routes.push(routeOf(pattern, name, load));

const address = () => location.pathname + location.search;

/** Aborted when the page is left: what a dialog asks, and what it sends, is about the page that it was opened on. */
export const visitSignal = () => visit.signal;

/**
 * Navigate to an address as if its link had been clicked: the new page begins at its top, or at the part of its anchor.
 * Resolves to the signal of this visit, which is aborted where another page was asked for meanwhile.
 * @param {string} path
 */
export async function navigate(path) {
  keepPlace();
  clearTimeout(scrolling);
  history.pushState(null, "", path);
  const showing = show();
  const { signal } = visit;
  await showing;
  if (signal.aborted) return signal;
  if (location.hash) scrollToAnchor(location.hash);
  else window.scrollTo(0, 0);
  return signal;
}

/** Writes down how far the entry is scrolled, once scrolling has ended.
 * @type {ReturnType<typeof setTimeout> | undefined} */
let scrolling;

/** Write down how far this entry of the history is scrolled. */
const keepPlace = () => history.replaceState({ scrolled: window.scrollY }, "");

/** Return to an entry of the history: its page, unless that is shown already, and where one was on it. */
async function goBack() {
  clearTimeout(scrolling); // it is of the entry that was left, and would be written into this one
  const place = history.state?.scrolled;
  if (address() !== shown) await show();
  if (place !== undefined) window.scrollTo(0, place);
  else if (location.hash) scrollToAnchor(location.hash);
  else window.scrollTo(0, 0);
}

/**
 * Write values into the query string without navigation; null removes one.
 * @param {Record<string, string | number | null | undefined>} choice
 */
export function updateQuery(choice) {
  const text = changedQuery(location.search, choice);
  history.replaceState(history.state, "", (text ? `?${text}` : location.pathname) + location.hash);
  shown = address();
}

/** @returns {Query} */
export const query = () => Object.fromEntries(new URLSearchParams(location.search));

/**
 * Show the page of the current address. `quiet`: what is shown stays until the page is there.
 * @param {{ quiet?: boolean }} [options]
 */
export async function show({ quiet = false } = {}) {
  pageAbort.abort();
  pageAbort = new AbortController();
  const { signal } = pageAbort;
  const main = document.querySelector("main");
  if (!main) return;
  if (address() !== shown) {
    visit.abort();
    visit = new AbortController();
  }
  shown = address();
  const found = matchRoute(routes, location.pathname);
  window.dispatchEvent(new CustomEvent("labctl:moved"));
  main.setAttribute("aria-busy", "true");
  const endFrame = quiet ? () => {} : framed(main, found?.name ?? "labctl");
  signal.addEventListener("abort", endFrame);
  try {
    const module = await (found ? found.load() : import("../pages/not_found.js"));
    const element = await module.page({ params: found?.params ?? {}, query: query(), signal });
    endFrame();
    if (signal.aborted) return;
    main.replaceChildren(element);
    performance.mark("labctl:page"); // for the browser's own profiler, and benchmarks
    const heading = element.querySelector("h1");
    setPageName(heading ? `${heading.textContent} · labctl` : "labctl");
    if (navigated && (document.activeElement === document.body || main.contains(document.activeElement)))
      main.focus({ preventScroll: true });
    navigated = true;
  } catch (error) {
    endFrame();
    if (signal.aborted || isAbort(error)) return;
    await showError(main, error, signal);
  } finally {
    if (!signal.aborted) main.removeAttribute("aria-busy");
  }
}

/**
 * Show an error in place of the page; where it may pass, the page is shown as soon as the service can answer it.
 * @param {HTMLElement} main
 * @param {unknown} error
 * @param {AbortSignal} signal
 */
async function showError(main, error, signal) {
  const { errorPage } = await import("./components.js");
  const hadFocus = main !== document.activeElement && main.contains(document.activeElement);
  main.replaceChildren(errorPage(error, () => show()));
  if (hadFocus) main.querySelector("button")?.focus({ preventScroll: true });
  if (error instanceof Problem && waitOf(error) !== null) setTrouble(error.message);
  whenItMayPass(error, signal, () => show({ quiet: true }));
}

/**
 * Scroll to an anchor, and move the keyboard focus there where the element can have it.
 * @param {string} hash
 */
function scrollToAnchor(hash) {
  const part = document.getElementById(hash.slice(1));
  part?.scrollIntoView();
  part?.focus({ preventScroll: true });
}

/** Handle clicks on links between pages, and show the first page. */
export function start() {
  document.addEventListener("click", (event) => {
    const link = event.target instanceof Element ? event.target.closest("a[href]") : null;
    if (
      !(link instanceof HTMLAnchorElement) ||
      event.defaultPrevented ||
      event.button ||
      event.metaKey ||
      event.ctrlKey ||
      event.shiftKey ||
      link.download ||
      link.target
    )
      return;
    const url = new URL(link.href);
    if (
      url.origin !== location.origin ||
      url.pathname.startsWith("/api") ||
      url.pathname.startsWith("/static") ||
      !matchRoute(routes, url.pathname)
    )
      return;
    event.preventDefault();
    if (url.hash && url.pathname + url.search === address()) {
      keepPlace();
      if (url.hash !== location.hash) history.pushState(null, "", url.hash);
      return scrollToAnchor(url.hash);
    }
    navigate(url.pathname + url.search + url.hash);
  });
  history.scrollRestoration = "manual"; // the browser restores it before the page is there
  window.addEventListener("popstate", goBack);
  window.addEventListener(
    "scroll",
    () => {
      clearTimeout(scrolling);
      scrolling = setTimeout(keepPlace, SCROLLED_MS);
    },
    { passive: true },
  );
  return goBack();
}
