// Fit a model to one recording or several: the choice of the model and the button.

import { post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { actButton } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { navigate } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { postFit } from "./accept_warnings.js";
import { asked, inAddress } from "./chosen_recordings.js";
import { firstModels } from "./first_models.js";

/** @import { RecordingRow } from "../../../types/api.js" */
/** @import { Chosen } from "./chosen_recordings.js" */

/**
 * @param {string} serial
 * @param {() => Chosen} chosen
 * @param {RecordingRow["motion"] | undefined} motion
 * @param {string} text of the button
 */
export function fitForm(serial, chosen, motion, text) {
  const models = firstModels(motion);
  let model = models[0];
  return h(
    "div",
    { class: "row", style: "align-items: end; min-width: 0" },
    selectField(
      "Model",
      models.map((each) => option(each.id, each.text)),
      model.id,
      (value) => {
        model = models.find((each) => each.id === value) ?? models[0];
      },
    ),
    actButton(
      text,
      async () => {
        const of = chosen();
        const made = await postFit(
          (accepted) =>
            post("/api/units/{serial}/calibrations", {
              path: { serial },
              body: { ...asked(of), ...model.body, ...accepted },
            }),
          "Fit anyway",
        );
        if (!made) return;
        await navigate(`/explore?${changedQuery("", { unit: serial, version: made.version, ...inAddress(of) })}`);
      },
      { kind: "primary" },
    ),
  );
}
