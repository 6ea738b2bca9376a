// Compare: the version as it is beside the recording. Points, lines, surfaces and turns all come from one answer.

import { get } from "../../core/api.js";
import { h } from "../../core/elements.js";
import { cardWithHeader, loadInto, toggleGroup } from "../../core/components.js";
import { query, updateQuery } from "../../core/router.js";
import { allPanels, overRate, overTemperature } from "./model_lines.js";
import { atRest } from "./at_rest.js";
import { surfaces } from "./surfaces.js";
import { fullTurn } from "./full_turn.js";

const VIEWS = [
  ["lines", "Error over rate", overRate],
  ["warm", "Error over temperature", overTemperature],
  ["panels", "Every output and axis", allPanels],
  ["surface", "Surface", surfaces],
  ["rest", "At rest", atRest],
  ["turn", "Per full turn", fullTurn],
];

export function errorComparison(state, path, signal) {
  const place = h("div", { style: "min-height: 28rem" });
  const source = h("p", { class: "muted small" });
  let view = VIEWS.some(([id]) => id === query().view) ? query().view : "lines";
  let comparison = null;
  const shown = () =>
    loadInto(place, "Reading the data sets", async () => {
      comparison ??= await get(`${path}/comparison`, { query: { recording: state.recording }, signal });
      source.textContent = sourceText(comparison);
      return VIEWS.find(([id]) => id === view)[2](comparison, state);
    });
  shown();
  state.onchange((what) => what === "axis" && shown());
  return cardWithHeader(
    "Compare",
    toggleGroup("What to compare", VIEWS, view, (value) => {
      view = value;
      updateQuery({ view: value === "lines" ? null : value });
      shown();
    }),
    source,
    place,
  );
}

function sourceText({ source, held, left_out: leftOut }) {
  const at = Object.entries(held).map(([name, value]) => `${name} ${Number(value.toPrecision(4))}`);
  return `Model: ${source}.${at.length ? ` Lines are at ${at.join(", ")}.` : ""}${leftOut.length ? ` Without ${leftOut.map((line) => line.effect.replaceAll("_", " ")).join(", ")}, which ${leftOut.length > 1 ? "do" : "does"} not leave with the calibration.` : ""}`;
}
