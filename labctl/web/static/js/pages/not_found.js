import { h } from "../core/elements.js";
import { head } from "../core/components.js";

export function page() {
  return h("div", { class: "page" }, head("No such page", `Nothing is at ${location.pathname}.`), h("p", {}, h("a", { href: "/" }, "To the start")));
}
