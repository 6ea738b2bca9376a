// The catalogue of effects: all of them, or one on a page of its own.

import { get, Problem } from "../core/api.js";
import { book } from "../effects/list.js";
import { one } from "../effects/detail.js";

let kept = null;

export async function page({ params, query, signal }) {
  kept ??= (await get("/api/effects", { signal })).effects;
  if (!params.id) return book(kept, query);
  const effect = kept.find((each) => each.id === params.id);
  if (!effect) throw new Problem({ title: "No such effect", detail: `The catalogue has no effect ${params.id}.`, status: 404 });
  return one(effect, kept);
}
