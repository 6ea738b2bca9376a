// The catalogue of effects, or the page of one effect.

import { get, Problem } from "../core/api.js";
import { effectList } from "../effects/list.js";
import { effectDetail } from "../effects/detail.js";

let catalogue = null;

export async function page({ params, query, signal }) {
  catalogue ??= (await get("/api/effects", { signal })).effects;
  if (!params.id) return effectList(catalogue, query);
  const effect = catalogue.find((each) => each.id === params.id);
  if (!effect)
    throw new Problem({ title: "No such effect", detail: `The catalogue has no effect ${params.id}.`, status: 404 });
  return effectDetail(effect, catalogue);
}
