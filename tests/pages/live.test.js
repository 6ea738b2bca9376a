// Live calibration: poses in the picture, texts, and U as shares of its limits.

import assert from "node:assert/strict";
import { test } from "node:test";

import { axesInPicture, depthBelow, dot, seenFaces } from "../../labctl/web/static/js/live/pose_axes.js";
import { offText, sharesOfLimits, stillText, unusedTexts } from "../../labctl/web/static/js/live/texts.js";

/** @import { LiveHistory, LiveMoment } from "../../labctl/web/types/api.js" */

const UPS = [-1, 0, 1]
  .flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => [x, y, z])))
  .filter((up) => Math.hypot(...up) > 0)
  .map((up) => up.map((v) => v / Math.hypot(...up)));

test("in each of the 26 poses the axes are right-handed, of length 1, and what points up is up", () => {
  assert.equal(UPS.length, 26);
  for (const up of UPS) {
    const [x, y, z] = axesInPicture(up);
    const turned = [0, 1, 2].map((k) => up[0] * x[k] + up[1] * y[k] + up[2] * z[k]);
    assert.ok(Math.abs(turned[0]) < 1e-12 && Math.abs(turned[1]) < 1e-12 && Math.abs(turned[2] - 1) < 1e-12);
    for (const [a, b] of /** @type {const} */ ([
      [x, y],
      [y, z],
      [z, x],
    ]))
      assert.ok(Math.abs(dot(a, b)) < 1e-12 && Math.abs(dot(a, a) - 1) < 1e-12);
    const volume = dot([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]], z);
    assert.ok(Math.abs(volume - 1) < 1e-12);
  }
});

test("at most three faces of a cube are seen, and its lowest corner is on the table", () => {
  for (const up of UPS) {
    const axes = axesInPicture(up);
    const faces = seenFaces(axes);
    assert.ok(faces.length >= 1 && faces.length <= 3);
    const lowest = Math.min(...faces.flatMap(({ corners }) => corners.map((corner) => corner[2])));
    assert.ok(lowest >= -depthBelow(axes) - 1e-12);
  }
  assert.equal(depthBelow(axesInPicture([0, 0, -1])), 1);
  assert.ok(Math.abs(depthBelow(axesInPicture([1, 1, 1])) - Math.sqrt(3)) < 1e-12);
});

/** @param {Partial<LiveMoment>} some */
const moment = (some) => /** @type {LiveMoment} */ (some);

test("rest, angle and what is not used are said in words", () => {
  assert.equal(stillText(moment({ still_s: 1.24 }), 2), "at rest for 1.2 s of 2 s");
  assert.equal(stillText(moment({ still_s: 0 }), 2), "in motion");
  assert.equal(offText(moment({ off_deg: null })), "");
  assert.equal(offText(moment({ off_deg: 90.4 })), "90 deg from the pose that is needed");
  assert.equal(offText(moment({ off_deg: 3 })), "3 deg from the pose that is needed: this is the pose");
  assert.deepEqual(unusedTexts(moment({ damaged: 2, example: "no JSON: '{'", lost: 5, left_out: ["the turn ..."] })), [
    "2 lines or frames could not be read; the first: no JSON: '{'",
    "5 readings are missing from the stream",
    "the turn ...",
  ]);
});

test("U is drawn as a share of its limit, for all fits, where there is a limit", () => {
  /** @type {LiveHistory} */
  const history = {
    number: 1,
    t_s: [10, 20],
    poses: [12, 13],
    coefficients: [
      { axis: "x", name: "scale_factor", unit: "1", limit: 0.001, expanded: [null, 0.0005] },
      { axis: "x", name: "g_own", unit: "deg/s/g", limit: null, expanded: [1, 2] },
    ],
  };
  assert.deepEqual(sharesOfLimits(history), [{ axis: "x", name: "scale_factor", t_s: [10, 20], share: [null, 0.5] }]);
});
