// Layout around every page: how fresh it is, sidebar, access key, colour theme.

import { accessKey, setAccessKey } from "./http/api.js";
import { setChildren, h, svg } from "./elements.js";
import { dialog } from "./dialog.js";
import { freshnessLine } from "./freshness/line.js";
import { printPage } from "./print.js";
import { show } from "./router.js";
import { staticUrl } from "./static_url.js";

const NAVIGATION = [
  ["/bench", "Bench", "M4 20h16M6 20V9l6-5 6 5v11M10 20v-5h4v5"],
  ["/campaigns", "Campaigns", "M4 5h16M4 12h10M4 19h7M17 14v6m-3-3h6"],
  ["/units", "Units", "M12 3l8 4.5v9L12 21l-8-4.5v-9zM4 7.5l8 4.5 8-4.5M12 12v9"],
  ["/fleet", "Fleet", "M4 20V10h4v10M10 20V4h4v16M16 20v-7h4v7"],
  ["/explore", "Explore", "M4 19l5-7 4 3 7-10M4 5v14h16"],
  ["/recordings", "Recordings", "M3 12h3l2-6 4 12 3-9 2 3h4"],
  ["/effects", "Effects", "M5 4h11a3 3 0 013 3v13H8a3 3 0 01-3-3zM5 17a3 3 0 013-3h11"],
];

/** @param {string} path */
const icon = (path) =>
  svg(
    "svg",
    {
      viewBox: "0 0 24 24",
      fill: "none",
      stroke: "currentColor",
      "stroke-width": "1.8",
      "stroke-linecap": "round",
      "stroke-linejoin": "round",
      "aria-hidden": "true",
    },
    svg("path", { d: path }),
  );

export function buildLayout() {
  const links = NAVIGATION.map(([path, name, drawing]) => h("a", { href: path }, icon(drawing), name));
  /** @type {HTMLElement[]} */
  const themes = [];
  /** @type {HTMLElement[]} */
  const keys = [];
  /** Buttons for theme, access key and printing: in the sidebar, and below the page on a narrow screen. */
  const controls = () => {
    const theme = h("button", { type: "button", class: "button quiet tiny", onclick: swap });
    const key = h("button", { type: "button", class: "button quiet tiny", onclick: () => askKey() });
    themes.push(theme);
    keys.push(key);
    const print = h("button", { type: "button", class: "button quiet tiny", onclick: printPage }, "Print or PDF");
    return [theme, key, print];
  };
  const name = () => {
    for (const each of themes)
      setChildren(each, document.documentElement.dataset.theme === "dark" ? "Light colours" : "Dark colours");
    for (const each of keys) setChildren(each, accessKey() ? "Forget the key" : "Use a key");
  };

  function swap() {
    const dark = document.documentElement.dataset.theme !== "dark";
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    localStorage.setItem("labctl.theme", dark ? "dark" : "light");
    name();
    window.dispatchEvent(new CustomEvent("labctl:theme"));
  }

  let asking = false;
  /** @param {string} [why] */
  async function askKey(why) {
    if (accessKey() && !why) {
      setAccessKey(null);
      name();
      return show();
    }
    if (asking) return null;
    asking = true;
    const given = await dialog(
      why ? "This service requires a key" : "Use a key",
      [
        {
          name: "key",
          label: "Key",
          type: "password",
          hint: "The command labctl key create makes a key. The key is kept in this tab until the tab is closed.",
        },
      ],
      { text: why, confirm: "Use it" },
    );
    asking = false;
    if (!given) return null;
    setAccessKey(given.key.trim());
    name();
    return show();
  }

  window.addEventListener("labctl:key", (event) =>
    askKey(
      event.detail ??
        "Reading needs a key with the role viewer; starting or changing something needs a key with the role operator.",
    ),
  );
  window.addEventListener("labctl:moved", () =>
    links.forEach((link) => {
      const here = location.pathname === link.pathname || location.pathname.startsWith(`${link.pathname}/`);
      here ? link.setAttribute("aria-current", "page") : link.removeAttribute("aria-current");
    }),
  );

  document.body.append(
    h("a", { class: "skip-link", href: "#main" }, "To the page"),
    h(
      "nav",
      { class: "sidebar", "aria-label": "Pages" },
      h("a", { class: "brand", href: "/" }, h("img", { src: staticUrl("mark.svg"), alt: "" }), "labctl"),
      h("div", { class: "sidebar-links" }, links),
      h("div", { class: "sidebar-footer" }, controls()),
    ),
    h(
      "div",
      { class: "content" },
      h("header", { class: "head" }, freshnessLine()),
      h("main", { id: "main", tabindex: "-1" }),
    ),
    h("footer", { class: "page-footer" }, controls()),
    h("div", { class: "toasts", "aria-live": "polite" }),
  );
  name();
}
