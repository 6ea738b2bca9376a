// A fit that the service refuses: why, in its own sentences, and the question whether to do it all the same.

import { Problem } from "../core/http/errors.js";
import { h } from "../core/elements.js";
import { notice } from "../core/components.js";
import { dialog } from "../core/dialog.js";
import { visitSignal } from "../core/router.js";

/**
 * Make a fit or a change: `fit(accepted)` posts it. Where the data or the result are certainly wrong the person decides;
 * `confirm` is what the button for that says. Return the answer, or null where the person leaves it.
 * @template Answer
 * @param {(accepted: { accept_warnings?: boolean }) => Promise<Answer>} fit
 * @param {string} confirm
 * @returns {Promise<Answer | null>}
 */
export async function postFit(fit, confirm) {
  const signal = visitSignal();
  try {
    return await fit({});
  } catch (error) {
    if (!(error instanceof Problem) || !error.type?.endsWith(":data-refused")) throw error;
    const answers = await dialog("The fit is refused", [], {
      text: "A calibration from these data would be wrong. Correct what the warnings name, or choose other data. If you make a version nevertheless, these warnings are stored with it.",
      body: against(error),
      confirm,
      kind: "danger",
      signal,
    });
    return answers && fit({ accept_warnings: true });
  }
}

/** @param {Problem} problem */
function against({ warnings, message }) {
  const sentences = warnings?.length
    ? warnings.map((each) => `${each.severity === "certain" ? "Wrong" : "Check"}: ${each.text}`)
    : [message];
  return notice(
    "bad",
    h("p", {}, h("strong", {}, "Objections:")),
    h(
      "ul",
      { class: "plain" },
      sentences.map((each) => h("li", {}, `${each}.`)),
    ),
  );
}
