// The points of a recipe, rates by temperatures, as a plan: each point, rate and temperature is moved by mouse or keys.

import { setChildren, svg } from "../core/elements.js";
import { plainNumber } from "../core/format.js";
import { movedLevel, stepOf } from "./point_numbers.js";

/** @typedef {"rates" | "temperatures"} Along */
/** @typedef {{ rates: number[], temperatures: number[] }} Levels */
/** @typedef {{ rates: [number, number], temperatures: [number, number] }} Ranges */

const [WIDE, NARROW, HEIGHT, LEFT, BOTTOM, RIM] = [640, 350, 320, 64, 44, 16];
/** A page that is narrower is a phone: the plan has fewer units, so that its words keep their size, px. */
const PHONE_PX = 760;
/** Steps of Page Up and Page Down, and of an arrow with Shift. */
const LARGE = 10;
const NAMES = { rates: "Rate", temperatures: "Temperature" };
const UNITS = { rates: "deg/s", temperatures: "°C" };
/** @type {Record<string, number>} */
const KEYS = {
  ArrowRight: 1,
  ArrowUp: 1,
  ArrowLeft: -1,
  ArrowDown: -1,
  PageUp: LARGE,
  PageDown: -LARGE,
};

/**
 * The plan. `levels` is changed by what is moved, then `moved()` is called.
 * @param {Levels} levels
 * @param {Ranges} shown what the axes show
 * @param {Ranges} use the range that U is of: it is shaded
 * @param {() => unknown} moved
 */
export function pointPlan(levels, shown, use, moved) {
  const width = innerWidth < PHONE_PX ? NARROW : WIDE;
  const drawing = svg("svg", {
    class: "point-plan",
    viewBox: `0 0 ${width} ${HEIGHT}`,
    role: "group",
    "aria-label": "Points of the recipe: rates and temperatures",
  });
  /** @param {number} rate */
  const x = (rate) => LEFT + share(rate, shown.rates) * (width - LEFT - RIM);
  /** @param {number} warm */
  const y = (warm) => HEIGHT - BOTTOM - share(warm, shown.temperatures) * (HEIGHT - BOTTOM - RIM);

  /**
   * @param {Along} along
   * @param {number} k
   * @param {number} value
   */
  function move(along, k, value) {
    const put = movedLevel(levels[along], k, value, shown[along]);
    if (put === levels[along][k]) return;
    levels[along][k] = put;
    place();
    moved();
  }

  /** @type {{ element: SVGElement, place: () => void }[]} */
  const parts = [];
  /**
   * @param {SVGElement} element
   * @param {() => Record<string, string | number>} attributes
   */
  const part = (element, attributes) => {
    const put = () => Object.entries(attributes()).forEach(([name, value]) => element.setAttribute(name, `${value}`));
    put();
    parts.push({ element, place: put });
    return element;
  };
  const place = () => parts.forEach((each) => each.place());

  /**
   * Follow the pointer from its press on an element until it is released.
   * @param {SVGElement} element
   * @param {{ rates?: number, temperatures?: number }} which the levels that move with it
   */
  function draggable(element, which) {
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      event.preventDefault();
      element.focus();
    });
    element.addEventListener("pointermove", (event) => {
      if (!element.hasPointerCapture(event.pointerId)) return;
      const box = drawing.getBoundingClientRect();
      const [px, py] = [
        ((event.clientX - box.left) / box.width) * width,
        ((event.clientY - box.top) / box.height) * HEIGHT,
      ];
      if (which.rates !== undefined) move("rates", which.rates, at((px - LEFT) / (width - LEFT - RIM), shown.rates));
      if (which.temperatures !== undefined)
        move(
          "temperatures",
          which.temperatures,
          at((HEIGHT - BOTTOM - py) / (HEIGHT - BOTTOM - RIM), shown.temperatures),
        );
    });
  }

  /**
   * A level at the edge of the plan: a slider for mouse and keys.
   * @param {Along} along
   * @param {number} k
   */
  function handle(along, k) {
    const element = svg("circle", { class: "point-handle", r: 7, tabindex: 0, role: "slider" });
    part(element, () => {
      const value = levels[along][k];
      return {
        cx: along === "rates" ? x(value) : LEFT - 14,
        cy: along === "rates" ? HEIGHT - BOTTOM + 14 : y(value),
        "aria-label": `${NAMES[along]} ${k + 1} of ${levels[along].length}`,
        "aria-valuemin": shown[along][0],
        "aria-valuemax": shown[along][1],
        "aria-valuenow": value,
        "aria-valuetext": `${plainNumber(value)} ${UNITS[along]}`,
        "aria-orientation": along === "rates" ? "horizontal" : "vertical",
      };
    });
    draggable(element, { [along]: k });
    element.addEventListener("keydown", (event) => {
      const steps = (KEYS[event.key] ?? 0) * (event.shiftKey ? LARGE : 1);
      if (!steps) return;
      event.preventDefault();
      move(along, k, levels[along][k] + steps * stepOf(shown[along]));
    });
    return element;
  }

  const points = levels.temperatures.flatMap((_, j) =>
    levels.rates.map((_, k) => {
      const element = part(svg("circle", { class: "point", r: 5 }), () => ({
        cx: x(levels.rates[k]),
        cy: y(levels.temperatures[j]),
        "data-point": `${levels.rates[k]},${levels.temperatures[j]}`,
      }));
      draggable(element, { rates: k, temperatures: j });
      return element;
    }),
  );
  setChildren(
    drawing,
    svg("rect", {
      class: "point-range",
      x: x(use.rates[0]),
      y: y(use.temperatures[1]),
      width: x(use.rates[1]) - x(use.rates[0]),
      height: y(use.temperatures[0]) - y(use.temperatures[1]),
    }),
    svg("path", { class: "point-axes", d: `M${LEFT} ${RIM}V${HEIGHT - BOTTOM}H${width - RIM}` }),
    ...ends("rates").flatMap((value) => label(value, x(value), HEIGHT - 6, "middle")),
    ...ends("temperatures").flatMap((value) => label(value, LEFT - 28, y(value) + 4, "end")),
    word("rate, deg/s", (LEFT + width - RIM) / 2, HEIGHT - 6, "middle"),
    word("°C", LEFT - 28, RIM + 2, "end"),
    points,
    levels.rates.map((_, k) => handle("rates", k)),
    levels.temperatures.map((_, k) => handle("temperatures", k)),
  );
  return drawing;

  /** @param {Along} along */
  function ends(along) {
    return use[along];
  }
  /**
   * @param {number} value
   * @param {number} px
   * @param {number} py
   * @param {string} anchor
   */
  function label(value, px, py, anchor) {
    return [word(plainNumber(value), px, py, anchor)];
  }
}

/**
 * @param {string} text
 * @param {number} px
 * @param {number} py
 * @param {string} anchor
 */
function word(text, px, py, anchor) {
  const element = svg("text", { x: px, y: py, "text-anchor": anchor });
  element.textContent = text;
  return element;
}

/**
 * @param {number} value
 * @param {readonly [number, number]} range
 */
const share = (value, [low, high]) => (value - low) / (high - low);
/**
 * @param {number} part
 * @param {readonly [number, number]} range
 */
const at = (part, [low, high]) => low + part * (high - low);
