// The title and the icon of the tab: what page it is, and whether something on it needs a person.

import { staticUrl } from "./static_url.js";

let name = "labctl";
/** What each part of the page says that needs a person; the first one is shown.
 * @type {Map<string, string>} */
const alarms = new Map();

function draw() {
  const alarm = alarms.values().next().value ?? "";
  document.title = alarm ? `${alarm} · ${name}` : name;
  const icon = document.querySelector('link[rel="icon"]');
  const file = staticUrl(alarm ? "mark-alarm.svg" : "mark.svg");
  if (icon && icon.getAttribute("href") !== file) icon.setAttribute("href", file);
}

/** @param {string} title of the page that is shown */
export function setPageName(title) {
  name = title;
  draw();
}

/**
 * Turn the icon of the tab red and put words before its title; "" ends that.
 * @param {string} words
 * @param {string} source the part of the page that says it
 */
export function setAlarm(words, source) {
  if ((alarms.get(source) ?? "") === words) return;
  if (words) alarms.set(source, words);
  else alarms.delete(source);
  draw();
}
