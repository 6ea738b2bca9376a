// The page of an address that no route matches.

import { h } from "../core/elements.js";
import { pageHeader } from "../core/components.js";

export function page() {
  return h(
    "div",
    { class: "page" },
    pageHeader("No such page", `There is no page ${location.pathname}.`),
    h("p", {}, h("a", { href: "/" }, "To the start")),
  );
}
