// Which process drives each of the other benches of a database that several services share. Needs no browser.

/** @import { BenchStatus } from "../../../types/api.js" */

/**
 * One line for each bench but this service's own: its name, what is known of its service, and whether that is a fault.
 * A database whose benches have no service but this one gives no line.
 * @param {readonly BenchStatus[]} states
 * @param {string | undefined} own
 */
export function otherBenches(states, own) {
  const others = states.filter((each) => each.name !== own);
  if (!others.some((each) => each.driver)) return [];
  return others.map(({ name, driver, left = [] }) => ({
    name,
    text: [driver ? driver.text : "no service drives the bench", ...left].join("; "),
    isFault: Boolean(driver && !driver.alive) || left.length > 0,
  }));
}
