// A fit that the service refuses: why, in its own sentences, and the question whether to do it all the same.

import { post } from "../core/api.js";
import { h } from "../core/elements.js";
import { dialog, notice } from "../core/components.js";

/**
 * Post a fit or a change. Where the data or the result are certainly wrong the person decides; `confirm` is what the
 * button for that says. Return the answer, or null where the person leaves it.
 */
export async function postFit(path, body, confirm) {
  try {
    return await post(path, body);
  } catch (error) {
    if (!error.type?.endsWith(":data-refused")) throw error;
    const answers = await dialog("The fit is refused", [], {
      text: "The calibration would be wrong. A version that is made anyway keeps these warnings.",
      body: against(error),
      confirm,
      kind: "danger",
    });
    return answers && post(path, { ...body, accept_warnings: true });
  }
}

function against({ warnings, message }) {
  const sentences = warnings?.length
    ? warnings.map((each) => `${each.severity === "certain" ? "Wrong" : "Check"}: ${each.text}`)
    : [message];
  return notice(
    "bad",
    h("p", {}, h("strong", {}, "This speaks against it:")),
    h(
      "ul",
      { class: "plain" },
      sentences.map((each) => h("li", {}, `${each}.`)),
    ),
  );
}
