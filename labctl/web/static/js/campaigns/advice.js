// A failed campaign in words: what happened, what labctl did, what to do next.

import { h } from "../core/elements.js";
import { notice } from "../core/components.js";

/** @import { Campaign } from "../../../types/api.js" */

/**
 * Null for a campaign that has not failed.
 * @param {Pick<Campaign, "advice" | "reason">} campaign
 */
export function adviceNotice(campaign) {
  const { advice } = campaign;
  if (!advice) return null;
  return notice(
    "bad",
    h("p", { class: "lead" }, advice.happened),
    h("p", {}, advice.done),
    h("p", {}, h("strong", {}, "Next: "), advice.next),
    h("p", { class: "small" }, `Reason: ${campaign.reason}`),
  );
}
