// What every page says of a service without a bench.

/** A sentence without its end: each page says after it what follows there. A test holds it to that of the service. */
export const NO_BENCH = "This service drives no bench";
/** The commands that start a service with a bench. */
export const WITH_BENCH = { simulated: "labctl serve --simulate", real: "labctl serve --bench FILE" };
