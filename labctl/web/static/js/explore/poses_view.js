// A version on a recording in poses: no rate is known, so nothing is criticised; gravity says what it leaves.

import { get } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { number } from "../core/format.js";
import { cardWithHeader, chip, factList, loadInto, table } from "../core/components.js";
import { ladderFigure } from "./error_ladder.js";
import { motionComparison } from "./compare/motion_comparison.js";

/** @import { Verification, Version } from "../../../types/api.js" */

/**
 * @param {string} serial
 * @param {Version} calibration
 * @param {number} recording
 * @param {AbortSignal} signal
 */
export function posesView(serial, calibration, recording, signal) {
  const path = { serial, version: calibration.version };
  const verified = h("section", { class: "card stack verdict", "aria-label": "Verdict" });
  loadInto(verified, "Applying the version", async () => {
    const found = await get("/api/units/{serial}/calibrations/{version}/verification", {
      path,
      query: { recording },
      signal,
    });
    verified.classList.add(found.ok ? "good" : "bad");
    return [
      h(
        "div",
        { class: "row" },
        chip(found.ok ? "As expected" : "Worse than expected", found.ok ? "good" : "bad"),
        h("span", { class: "muted small" }, `version ${path.version} applied to recording ${recording}`),
      ),
      h(
        "p",
        {},
        "A recording of poses contains the direction of gravity before and after each turn, but no rate. It can verify a version, but it cannot show which effect is missing.",
      ),
      factList([
        [
          "Error of a turn, RMS",
          number(found.rms_dps),
          "deg/s",
          "error of the direction of gravity, over the duration of the turn",
        ],
        ["Largest", number(found.max_dps), "deg/s"],
        found.expected_dps === null ? null : ["Expected of this version", number(found.expected_dps), "deg/s"],
        ["Turns", `${found.datasets}`],
      ]),
      verifiedAxes(found),
    ];
  });
  const ladder = h("div", {});
  loadInto(ladder, "RMS error by version", async () =>
    ladderFigure(await get("/api/units/{serial}/ladder", { path: { serial }, signal }), "poses"),
  );
  const element = h("div", { class: "page" });
  setChildren(
    element,
    verified,
    motionComparison({ serial, version: path.version, recording, axis: "x", onchange: () => {}, calibration }, signal),
    cardWithHeader("Error of the versions", null, ladder),
  );
  return element;
}

/**
 * Each axis beside what is expected of it.
 * @param {Verification} found
 */
function verifiedAxes(found) {
  return table(
    [
      { title: "Axis", cell: (row) => row.axis },
      { title: "RMS, deg/s", number: true, cell: (row) => number(row.rms_dps) },
      { title: "Expected, deg/s", number: true, cell: (row) => number(row.expected_dps) },
      { title: "Limit, deg/s", number: true, cell: (row) => number(row.limit_dps) },
      { title: "Mean, deg/s", number: true, cell: (row) => number(row.bias_dps) },
      { title: "Limit kept", cell: (row) => (row.ok === false ? chip("off", "bad") : null) },
    ],
    Object.entries(found.axes).map(([axis, each]) => ({ axis, ...each })),
    { label: "Error of each axis", dense: true },
  );
}
