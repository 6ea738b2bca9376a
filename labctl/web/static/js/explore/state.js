// What is looked at, picked and drawn over; whoever shows it is told when it changes.

import { updateQuery } from "../core/router.js";
import { toRanges, fromRanges } from "./dataset_rows.js";

export class ExploreState {
  constructor(given) {
    Object.assign(this, given); // serial, version, recording, axis, criticism, unit, versions
    this.pick = fromRanges(given.pick);
    this.overlay = null; // {name, values: one for each data set}, drawn over the residual
    this.listeners = [];
  }

  onchange(listener) {
    this.listeners.push(listener);
  }

  /** Pick data sets by number; an empty pick lets go of all. */
  choose(numbers) {
    this.pick = new Set(numbers);
    updateQuery({ pick: this.pick.size ? toRanges(this.pick) : null });
    this.tell("pick");
  }

  draw(overlay) {
    this.overlay = overlay;
    this.tell("overlay");
  }

  look(axis) {
    this.axis = axis;
    this.overlay = null;
    updateQuery({ axis });
    this.tell("axis");
  }

  tell(what) {
    for (const listener of this.listeners) listener(what);
  }
}
