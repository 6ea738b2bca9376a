// The batch and the supplier of a unit, and the dialog that states them.

import { post } from "../core/http/api.js";
import { actButton, toast } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { show } from "../core/router.js";

/** @import { Unit } from "../../../types/api.js" */

/**
 * What the unit is, in one line: model, technology, batch and supplier, as far as they are stated.
 * @param {Unit} unit
 */
export const unitLine = (unit) =>
  [unit.model, unit.technology?.toUpperCase(), unit.batch && `batch ${unit.batch}`, unit.supplier]
    .filter(Boolean)
    .join(" · ");

/**
 * The button that asks for the batch.
 * @param {Unit} unit
 */
export const batchButton = (unit) => actButton("Set batch", () => askBatch(unit));

/** @param {Unit} unit */
async function askBatch(unit) {
  const answers = await dialog(
    `Batch of ${unit.serial}`,
    [
      { name: "batch", label: "Batch", value: unit.batch, required: false, hint: "Empty: no batch is stated." },
      { name: "supplier", label: "Supplier", value: unit.supplier, required: false },
      WHO,
    ],
    {
      text: "Lists of units are filtered by batch. The change is written to the audit trail.",
      confirm: "Set batch",
      send: ({ batch, supplier, by }, signal) =>
        post("/api/batches", { body: { batch, supplier, by, serials: [unit.serial] }, signal }),
    },
  );
  if (!answers) return;
  const { batch } = answers;
  toast("good", batch ? `${unit.serial} is of batch ${batch}.` : `No batch of ${unit.serial} is stated.`);
  await show();
}
