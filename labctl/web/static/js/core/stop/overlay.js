// Asks for a stop until it is confirmed, and shows over everything that the bench is not stopped while it is not.

import { h, setChildren } from "../elements.js";
import { get, post } from "../http/api.js";
import { messageOf } from "../http/errors.js";
import { confirms, notStopped } from "./state.js";

/** @import { Campaign } from "../../../../types/api.js" */

/** A request that is not answered within this is sent again. */
const PATIENCE_MS = 6000;
const AGAIN_MS = 1000;

/** @type {{ asked: number | null, trouble: string, reported: string }} */
const known = { asked: null, trouble: "", reported: "" };
/** @type {HTMLElement | null} */
let shown = null;

/** @param {number} ms */
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function draw() {
  const asked_ms = known.asked === null ? null : performance.now() - known.asked;
  const found = notStopped({ asked_ms, trouble: known.trouble, reported: known.reported });
  if (found === null) {
    shown?.remove();
    shown = null;
    return;
  }
  if (shown === null) {
    shown = h("div", { class: "not-stopped", role: "alert", "data-not-stopped": "" });
    document.body.append(shown);
  }
  const text = `${found.title}${found.text}`;
  if (shown.textContent !== text) setChildren(shown, h("strong", {}, found.title), h("p", {}, found.text));
}

/**
 * What the service reports of a stop that is late; nothing when all is well.
 * @param {string} [text]
 */
export function reportStop(text = "") {
  known.reported = text;
  draw();
}

/**
 * Stop a campaign: asks until it is confirmed that it has ended, whatever answers; resolves to the campaign, or to null
 * where only the page in place of the service has answered.
 * @param {number} campaign
 * @param {{ by?: string, reason: string }} body
 * @returns {Promise<Campaign | null>}
 */
export async function stopCampaign(campaign, body) {
  known.asked = performance.now();
  const drawing = setInterval(draw, 250);
  try {
    for (let first = true; ; first = false) {
      try {
        const signal = AbortSignal.timeout(PATIENCE_MS);
        const path = { campaign };
        const seen = first ? null : await get("/api/campaigns/{campaign}", { path, signal });
        const answer = seen?.ended ? seen : await post("/api/campaigns/{campaign}/abort", { path, body, signal });
        known.trouble = "";
        if (confirms(answer)) return "id" in answer ? answer : null;
      } catch (error) {
        known.trouble = messageOf(error);
      }
      draw();
      await pause(AGAIN_MS);
    }
  } finally {
    clearInterval(drawing);
    Object.assign(known, { asked: null, trouble: "" });
    draw();
  }
}
