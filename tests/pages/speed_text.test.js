// The speed of simulated time in words.

import assert from "node:assert/strict";
import { test } from "node:test";
import { slowText } from "../../labctl/web/static/js/bench/speed_text.js";

test("a speed that is not reached is said, beside the one that was asked for", () => {
  assert.equal(
    slowText({ speed: 200, speed_reached: 37.46 }),
    "Simulated time runs at 37 times real time; 200 was asked for, which this computer does not reach now.",
  );
  assert.match(slowText({ speed: 1000, speed_reached: 843.2 }), /runs at 840 times real time; 1000 was/);
  assert.match(slowText({ speed: 1, speed_reached: 0 }), /runs at 0 times real time; 1 was/);
});

test("nothing is said of a speed that is reached, not known yet, or not asked for", () => {
  for (const [speed, speed_reached] of [
    [200, 199.8],
    [200, 181],
    [200, null],
    [null, 1800],
    [null, null],
  ])
    assert.equal(slowText({ speed, speed_reached }), "");
});
