// Points of a figure for the keyboard: arrows move from one to the next, Enter or Space selects, Escape clears.

import { h, setChildren } from "./elements.js";

/** @import { Figure } from "../../../types/pages.js" */

/**
 * A point by its place: the panel of the figure, the column and the row in it.
 * @typedef {{ panel: number, column: number, row: number, sets: readonly number[], text: string }} Place
 */

/** Along a row before across rows: a place in the same row is nearer than any in another one. */
const ACROSS = 1e6;
/** Page Up and Page Down pass over so many points. */
const PAGE = 10;
/** @type {Record<string, readonly [column: number, row: number]>} */
const DIRECTIONS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * The place that a key leads to; the same place where there is none in that direction. Right of the last column of a
 * panel is the first of the next panel.
 * @template {Place} P
 * @param {readonly P[]} places
 * @param {P} from
 * @param {string} key
 * @returns {P}
 */
export function placeAfter(places, from, key) {
  if (key === "PageUp" || key === "PageDown") {
    const step = key === "PageDown" ? "ArrowRight" : "ArrowLeft";
    let at = from;
    for (let k = 0; k < PAGE; k += 1) at = placeAfter(places, at, step);
    return at;
  }
  if (key === "Home") return nearest(places, from, (place) => (place.panel === from.panel ? place.column : null));
  if (key === "End") return nearest(places, from, (place) => (place.panel === from.panel ? -place.column : null));
  const direction = DIRECTIONS[key];
  if (!direction) return from;
  const [columns, rows] = direction;
  return nearest(places, from, (place) => {
    const panels = columns * (place.panel - from.panel);
    if (panels < 0 || (rows && panels)) return null;
    if (panels) return panels * ACROSS * ACROSS + columns * place.column + ACROSS * Math.abs(place.row - from.row);
    const along = columns * (place.column - from.column) + rows * (place.row - from.row);
    const across = rows ? place.column - from.column : place.row - from.row;
    return along > 0 ? along + ACROSS * Math.abs(across) : null;
  });
}

/**
 * The place with the least distance; `from` where no place has one.
 * @template {Place} P
 * @param {readonly P[]} places
 * @param {P} from
 * @param {(place: P) => number | null} distance
 */
function nearest(places, from, distance) {
  let [found, least] = [from, Infinity];
  for (const place of places) {
    const far = distance(place);
    if (far !== null && far < least) [found, least] = [place, far];
  }
  return found;
}

/**
 * Let the keyboard reach the points of a figure. `places()` lists them as they are drawn now; `onmove` is called with the
 * point under the cursor, null where the figure has lost the focus, and draws it; `onselect` gets its data sets, with
 * Shift beside those that are selected.
 * @template {Place} P
 * @param {Figure} figure
 * @param {object} acts
 * @param {() => readonly P[]} acts.places
 * @param {(place: P | null) => unknown} acts.onmove
 * @param {(sets: readonly number[], beside: boolean) => unknown} acts.onselect
 */
export function reachByKeyboard(figure, { places, onmove, onselect }) {
  const { plot } = figure;
  const line = h("p", { class: "muted small keyboard-line", role: "status" });
  figure.append(line);
  plot.tabIndex = 0;
  plot.setAttribute("role", "application");
  plot.setAttribute("aria-roledescription", "figure; arrow keys move over its points, Enter selects, Escape clears");
  /** @type {P | null} */
  let at = null;
  /** @param {P | null} place */
  const move = (place) => {
    at = place;
    setChildren(line, place ? `${place.text}. Arrow keys: next point; Enter: select; Escape: clear.` : null);
    onmove(place);
  };
  plot.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const all = places();
    if (!all.length) return;
    if (event.key === "Escape") onselect([], false);
    else if (event.key === "Enter" || event.key === " ") {
      if (at) onselect(at.sets, event.shiftKey);
    } else {
      const next = at ? placeAfter(all, at, event.key) : event.key in DIRECTIONS ? all[0] : null;
      if (!next || (next === at && !(event.key in DIRECTIONS))) return;
      move(next);
    }
    event.preventDefault();
  });
  plot.addEventListener("blur", () => at && move(null));
}
