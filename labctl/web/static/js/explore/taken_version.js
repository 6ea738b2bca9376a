// A version that another tab or person has made since this page was shown: told, and a second one only when it is asked for.

import { Problem } from "../core/http/errors.js";
import { h } from "../core/elements.js";
import { notice } from "../core/components.js";
import { dialog } from "../core/dialog.js";
import { capitalised } from "../core/format.js";
import { visitSignal } from "../core/router.js";
import { changedQuery } from "../core/routes.js";

/**
 * Make a version under the number that the page promises; where that is taken, ask whether to make another one beside
 * it. Null: it is left at the one that exists.
 * @template Answer
 * @param {string} serial
 * @param {number} number
 * @param {(as: { as_version?: number }) => Promise<Answer | null>} make
 * @returns {Promise<Answer | null>}
 */
export async function unlessTaken(serial, number, make) {
  const signal = visitSignal();
  try {
    return await make({ as_version: number });
  } catch (error) {
    if (!(error instanceof Problem) || !error.type?.endsWith(":version-taken")) throw error;
    const href = `/explore?${changedQuery("", { unit: serial, version: number })}`;
    const answers = await dialog(`Version ${number} of ${serial} exists already`, [], {
      text: "It was made since this page was shown, in another tab or by another person. Nothing was made now.",
      body: notice(
        "warn",
        h("p", {}, `${capitalised(error.message)}.`),
        h("p", {}, h("a", { href }, `Explore version ${number}`)),
      ),
      confirm: "Make another version",
      signal,
    });
    return answers && make({});
  }
}
