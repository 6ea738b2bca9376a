// The request of a design from what a person typed.

/** @typedef {{ like: string, model: string, u_dps: string, hours: string }} Typed */

/**
 * What is asked for; what is empty is left to the service. Without a recipe and a model, the usual model.
 * @param {Typed} typed
 */
export function designBody({ like, model, u_dps, hours }) {
  return {
    ...(like ? { like } : {}),
    ...(model || !like ? { model: model || "bias_scale" } : {}),
    ...(u_dps ? { u_dps: Number(u_dps) } : {}),
    ...(hours ? { hours: Number(hours) } : {}),
  };
}
