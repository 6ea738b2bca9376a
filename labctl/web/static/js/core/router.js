// Client-side router: the address determines what the page shows.

const routes = [];
let pageAbort = new AbortController();
let navigated = false; // focus moves to the page from the second page on

/** Register the module of a pattern like `/units/:serial`. A module exports `page(context)`, which returns an element. */
export const route = (pattern, load) => routes.push({ parts: pattern.split("/").filter(Boolean), load });

function matchRoute(path) {
  const parts = path.split("/").filter(Boolean).map(decodeURIComponent);
  for (const { parts: pattern, load } of routes) {
    if (pattern.length !== parts.length) continue;
    const params = {};
    const fits = pattern.every((part, k) =>
      part.startsWith(":") ? ((params[part.slice(1)] = parts[k]), true) : part === parts[k],
    );
    if (fits) return { load, params };
  }
  return null;
}

/** Navigate to an address as if its link had been clicked. */
export function navigate(path) {
  history.pushState(null, "", path);
  return show();
}

/** Write values into the query string without navigation; null removes one. */
export function updateQuery(choice) {
  const query = new URLSearchParams(location.search);
  for (const [name, value] of Object.entries(choice)) {
    if (value === null || value === undefined || value === "") query.delete(name);
    else query.set(name, value);
  }
  const text = query.toString();
  history.replaceState(null, "", text ? `?${text}` : location.pathname);
}

export const query = () => Object.fromEntries(new URLSearchParams(location.search));

/** Show the page of the current address. */
export async function show() {
  pageAbort.abort();
  pageAbort = new AbortController();
  const { signal } = pageAbort;
  const main = document.querySelector("main");
  const found = matchRoute(location.pathname);
  window.dispatchEvent(new CustomEvent("labctl:moved"));
  main.setAttribute("aria-busy", "true");
  try {
    const module = await (found ? found.load() : import("../pages/not_found.js"));
    const element = await module.page({ params: found?.params ?? {}, query: query(), signal });
    if (signal.aborted) return;
    main.replaceChildren(element);
    performance.mark("labctl:page"); // for the browser's own profiler, and benchmarks
    const heading = element.querySelector("h1");
    document.title = heading ? `${heading.textContent} · labctl` : "labctl";
    if (navigated && (document.activeElement === document.body || main.contains(document.activeElement)))
      main.focus({ preventScroll: true });
    navigated = true;
  } catch (error) {
    if (signal.aborted || error.name === "AbortError") return;
    await showError(main, error, signal);
  } finally {
    if (!signal.aborted) main.removeAttribute("aria-busy");
  }
}

/** Show an error in place of the page. A page whose service did not answer is shown as soon as it is heard. */
async function showError(main, error, signal) {
  const [{ errorPage }, { Unreachable }] = await Promise.all([import("./components.js"), import("./api.js")]);
  main.replaceChildren(errorPage(error, show));
  if (error instanceof Unreachable) window.addEventListener("labctl:heard", show, { signal, once: true });
}

/** Scroll to an anchor, and move the keyboard focus there where the element can have it. */
function scrollToAnchor(hash) {
  const part = document.getElementById(hash.slice(1));
  part?.scrollIntoView();
  part?.focus({ preventScroll: true });
}

/** Handle clicks on links between pages, and show the first page. */
export function start() {
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.("a[href]");
    if (
      !link ||
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
      !matchRoute(url.pathname)
    )
      return;
    event.preventDefault();
    if (url.hash && url.pathname === location.pathname && url.search === location.search)
      return scrollToAnchor(url.hash);
    navigate(url.pathname + url.search + url.hash).then(() => url.hash && scrollToAnchor(url.hash));
    window.scrollTo(0, 0);
  });
  window.addEventListener("popstate", show);
  return show();
}
