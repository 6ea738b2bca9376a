// The catalogue of effects, or the page of one effect.

import { get } from "../core/http/api.js";
import { Problem } from "../core/http/errors.js";
import { effectList } from "../effects/list.js";
import { effectDetail } from "../effects/detail.js";

/** @import { Effect } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** @type {Effect[] | null} */
let catalogue = null;

/** @param {PageContext} context */
export async function page({ params, query, signal }) {
  catalogue ??= (await get("/api/effects", { signal })).effects;
  const all = catalogue;
  if (!params.id) return effectList(all, query);
  const effect = all.find((each) => each.id === params.id);
  if (!effect)
    throw new Problem({
      title: "No such effect",
      detail: `The catalogue has no effect ${params.id}; choose one from the list of effects.`,
      status: 404,
    });
  return effectDetail(effect, all);
}
