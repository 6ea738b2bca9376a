// State of the explore page: axis, selected data sets, overlay. Listeners are called on each change.

import { updateQuery } from "../core/router.js";
import { toRanges, fromRanges } from "./dataset_rows.js";

export class ExploreState {
  constructor(given) {
    Object.assign(this, given); // serial, version, recording, axis, criticism, unit, versions
    this.pick = fromRanges(given.pick);
    this.overlay = null; // {name, values: one for each data set}, plotted over the residual
    this.listeners = [];
  }

  onchange(listener) {
    this.listeners.push(listener);
  }

  /** Select data sets by number; an empty list clears the selection. */
  select(numbers) {
    this.pick = new Set(numbers);
    updateQuery({ pick: this.pick.size ? toRanges(this.pick) : null });
    this.notify("pick");
  }

  setOverlay(overlay) {
    this.overlay = overlay;
    this.notify("overlay");
  }

  selectAxis(axis) {
    this.axis = axis;
    this.overlay = null;
    updateQuery({ axis });
    this.notify("axis");
  }

  notify(what) {
    for (const listener of this.listeners) listener(what);
  }
}
