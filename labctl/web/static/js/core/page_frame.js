// The frame of a page that takes long: its name at once, what it waits for, and that one may leave.

import { h, setChildren } from "./elements.js";
import { busyIndicator, pageHeader } from "./components.js";
import { waitedFor } from "./http/pending.js";

/** A page that is there sooner needs no frame: it would only flicker. */
const FRAME_AFTER_MS = 250;
const TOLD_AFTER_S = 2;
const DRAW_MS = 500;

/**
 * Show the frame in `main` unless the page arrives before. Return a function that ends it.
 * @param {Element} main
 * @param {string} name of the page
 */
export function framed(main, name) {
  const requests = h("div", { class: "muted small", "aria-live": "polite" });
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let ticking;
  const draw = () => setChildren(requests, waitingLines());
  const begin = setTimeout(() => {
    main.replaceChildren(
      h("div", { class: "page page-frame" }, pageHeader(name), busyIndicator("Waiting for the service."), requests),
    );
    ticking = setInterval(draw, DRAW_MS);
    draw();
  }, FRAME_AFTER_MS);
  return () => {
    clearTimeout(begin);
    clearInterval(ticking);
  };
}

/** A line for each request that takes long, and what one can do meanwhile. */
function waitingLines() {
  const long = waitedFor().filter((each) => each.waited_s >= TOLD_AFTER_S);
  if (!long.length) return [];
  return [
    ...long.map((each) => h("p", {}, h("code", {}, each.what), ` has taken ${Math.floor(each.waited_s)} s so far.`)),
    h("p", {}, "You can open another page meanwhile; that cancels these requests."),
  ];
}
