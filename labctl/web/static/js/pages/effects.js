// The catalogue, to read.

import { get } from "../core/api.js";
import { h } from "../core/dom.js";
import { words } from "../core/format.js";
import { head } from "../core/parts.js";

export async function page({ params, signal }) {
  const catalogue = await get("/api/effects", { signal });
  return h("div", { class: "page" }, head("Effects", `${catalogue.effects?.length ?? 0} physical effects`), h("pre", {}, JSON.stringify(catalogue.effects?.[0] ?? catalogue, null, 1)), words(params.id ?? ""));
}
