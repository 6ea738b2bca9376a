// The title and the icon of the tab: what page it is, and whether something on it needs a person.

import { staticUrl } from "./static_url.js";

let [name, alarm] = ["labctl", ""];

function draw() {
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
 */
export function setAlarm(words) {
  if (words === alarm) return;
  alarm = words;
  draw();
}
