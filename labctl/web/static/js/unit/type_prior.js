// What the other calibrated units of a type have contributed to a version, in words. Needs no browser.

import { number } from "../core/format.js";

/** @import { TypePrior } from "../../../types/api.js" */

/** @param {TypePrior} prior */
export const priorText = ({ type, model, units, is_used, p_value }) =>
  is_used
    ? `Prior of the type: the coefficients also contain what ${units} other units of type ${type} by model ${model} say. A larger difference between this unit and its type has a probability of ${number(p_value, 2)}.`
    : `No prior of the type: this unit is unlike the ${units} other units of type ${type} by model ${model} (p = ${number(p_value, 2)}), and was fitted alone.`;
