// DOM elements: create, fill, identify, observe.

import { typeset } from "./typeset.js";

/** @import { Attributes, Child, SvgAttributes } from "../../../types/pages.js" */

const SVG = "http://www.w3.org/2000/svg";

/** What these elements hold is code: it is shown as it stands. */
const CODE = new Set(["CODE", "PRE", "TEXTAREA", "KBD"]);

/**
 * Create an element: `h("a", {href, class, onclick, "aria-label"}, ...children)`. Null, undefined and false are left out.
 * Texts are typeset, except in code.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Attributes} [attributes]
 * @param {...Child} children
 */
export function h(tag, attributes = {}, ...children) {
  return applyAttributes(document.createElement(tag), attributes, children);
}

/**
 * The same for SVG.
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {SvgAttributes} [attributes]
 * @param {...Child} children
 */
export function svg(tag, attributes = {}, ...children) {
  return applyAttributes(document.createElementNS(SVG, tag), attributes, children);
}

/**
 * @template {Element} E
 * @param {E} element
 * @param {Attributes | SvgAttributes} attributes
 * @param {Child} children
 */
function applyAttributes(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else if (name === "value" || name === "checked" || name === "disabled" || name === "selected")
      Object.assign(element, { [name]: value });
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...shown(children, element));
  return element;
}

/**
 * Replace the children of an element.
 * @template {Element} E
 * @param {E} element
 * @param {...Child} children
 */
export function setChildren(element, ...children) {
  element.replaceChildren(...shown(children, element));
  return element;
}

/**
 * @param {Child} child
 * @param {Element} element that it is put into
 * @returns {(Node | string)[]}
 */
function shown(child, element) {
  if (Array.isArray(child)) return child.flatMap((each) => shown(each, element));
  if (child === null || child === undefined || child === false) return [];
  if (child instanceof Node) return [child];
  return [CODE.has(element.tagName) ? String(child) : typeset(String(child))];
}

let numbers = 0;
/**
 * An id that is unique on the page, for a label and its field.
 * @param {string} stem
 */
export const uniqueId = (stem) => `${stem}-${++numbers}`;

/**
 * Call `act` once, when the element comes near the viewport.
 * @param {Element} element
 * @param {() => unknown} act
 */
export function whenNearViewport(element, act) {
  new IntersectionObserver(
    (entries, observer) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      act();
    },
    { rootMargin: "300px" },
  ).observe(element);
}

/** Whether the person has asked for as little motion as possible. */
export const wantsLessMotion = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/**
 * Scroll to an element: smoothly, or at once where less motion is wanted.
 * @param {Element} element
 * @param {ScrollLogicalPosition} [block]
 */
export const scrollTo = (element, block = "start") =>
  element.scrollIntoView({ behavior: wantsLessMotion() ? "auto" : "smooth", block });
