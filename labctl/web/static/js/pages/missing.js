import { h } from "../core/dom.js";
import { head } from "../core/parts.js";

export function page() {
  return h("div", { class: "page" }, head("No such page", `Nothing is at ${location.pathname}.`), h("p", {}, h("a", { href: "/" }, "To the start")));
}
