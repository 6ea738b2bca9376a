// The list of what is new: what is in it, in which order, and from when.

import assert from "node:assert/strict";
import { test } from "node:test";

import { beginOf, newsOf } from "../../labctl/web/static/js/start/news.js";

/** @import { Bench, CalibrationEvent, Campaign, Scheduled } from "../../labctl/web/types/api.js" */

const NOW = new Date(2026, 10, 26, 8, 30);
const TONIGHT = new Date(2026, 10, 26, 3, 0).toISOString();
const LAST_WEEK = new Date(2026, 10, 20, 3, 0).toISOString();

/**
 * A campaign that is done, with some fields changed.
 * @param {Partial<Campaign>} changed
 */
const campaign = (changed) =>
  /** @type {Campaign} */ (
    /** @type {unknown} */ ({
      id: 1,
      recipe: "short",
      bench: "triaxial",
      state: "done",
      reason: "",
      progress: 1,
      repeated: 0,
      prompt: null,
      started_at: LAST_WEEK,
      ended_at: TONIGHT,
      ended: true,
      active: false,
      abandoned: false,
      drafts: [],
      ...changed,
    })
  );

/**
 * @param {readonly Campaign[]} campaigns
 * @param {"evening" | "week" | "all"} [span]
 * @param {{ benches?: readonly Bench[], schedule?: readonly Scheduled[], events?: readonly CalibrationEvent[] }} [more]
 */
const news = (campaigns, span = "evening", { benches = [], schedule = [], events = [] } = {}) =>
  newsOf({ campaigns, benches, schedule, events }, span, NOW);

test("the evening before begins at 18:00 of the day before", () => {
  assert.equal(beginOf("evening", NOW), new Date(2026, 10, 25, 18).getTime());
  assert.equal(beginOf("week", NOW), new Date(2026, 10, 19, 8, 30).getTime());
});

test("campaigns are listed by their start, the newest first, whatever the clocks of their benches say", () => {
  const ends = ["16:42", "15:38", "18:31"];
  const done = ends.map((end, k) =>
    campaign({
      id: k + 1,
      simulated_time: true,
      ended_at: `2026-01-05T${end}:00.000Z`,
      started_at: "2026-01-05T08:00:00Z",
    }),
  );
  const about = news([...done].reverse()).map((row) => row.about);
  assert.deepEqual(about, ["Campaign 3", "Campaign 2", "Campaign 1"]);
});

test("a campaign that ended before is not new; one that still runs or waits is", () => {
  const old = campaign({ id: 2, ended_at: LAST_WEEK });
  const runs = campaign({ id: 3, state: "running", active: true, ended: false, ended_at: null, progress: 0.4 });
  const about = news([old, runs]).map((row) => row.about);
  assert.deepEqual(about, ["Campaign 3"]);
  assert.equal(news([old], "week").length, 1);
  assert.match(news([runs])[0].text, /40 % done\.$/);
});

test("what failed is first, then what a person decides, then what runs, then what is done", () => {
  const prompt = {
    id: "7",
    kind: "mounting",
    text: "Turn the unit to y up",
    position: "y",
    turn_deg: null,
    within_s: null,
  };
  const rows = news([
    campaign({ id: 1 }),
    campaign({ id: 2, state: "running", active: true, ended: false, ended_at: null, progress: 0.2 }),
    campaign({ id: 3, state: "waiting", active: true, ended: false, ended_at: null, prompt }),
    campaign({ id: 4, state: "failed", reason: "chamber: no answer" }),
  ]);
  assert.deepEqual(
    rows.map((row) => [row.kind, row.about]),
    [
      ["bad", "Campaign 4"],
      ["warn", "Campaign 3"],
      ["accent", "Campaign 2"],
      ["good", "Campaign 1"],
    ],
  );
  assert.match(rows[0].text, /chamber: no answer/);
  assert.match(rows[1].text, /Turn the unit to y up/);
  assert.equal(rows[1].href, "/bench");
});

/**
 * @param {string} verdict
 * @param {boolean} [certified]
 */
const draft = (verdict, certified = false) =>
  /** @type {Campaign["drafts"][number]} */ (
    /** @type {unknown} */ ({
      serial: "A/1",
      campaign: 1,
      recording: 1,
      state: "made",
      version: 2,
      certified,
      at: TONIGHT,
      reason: "",
      report: {
        verdict,
        verdict_text: `verdict ${verdict}.`,
        objections: [],
        error: { raw_rms_dps: 1, rms_dps: 0.02, heldout_rms_dps: 0.02, noise_floor_dps: 0.01 },
      },
    })
  );

test("a draft that is adequate leads to its certificate, another one to where it fails, a certified one nowhere", () => {
  const adequate = news([campaign({ drafts: [draft("adequate")] })]).find((row) => row.about === "A/1");
  assert.equal(adequate?.href, "/units/A%2F1?version=2");
  assert.equal(adequate?.over_floor, 2);
  const ambiguous = news([campaign({ drafts: [draft("ambiguous")] })]).find((row) => row.about === "A/1");
  assert.equal(ambiguous?.kind, "warn");
  assert.equal(ambiguous?.href, "/explore?unit=A%2F1&version=2");
  assert.match(ambiguous?.text ?? "", /verdict ambiguous\. The error is 2\.0 times the noise floor/);
  assert.ok(!news([campaign({ drafts: [draft("adequate", true)] })]).some((row) => row.about === "A/1"));
});

test("a start that was missed, and a bench that is not confirmed safe, are new until they are dealt with", () => {
  const bench = /** @type {Bench} */ (/** @type {unknown} */ ({ name: "triaxial", unconfirmed: "table" }));
  const missed = { at: TONIGHT, due_at: TONIGHT, outcome: "missed", message: "the service was off", campaign: null };
  const old = { ...missed, at: LAST_WEEK };
  const start = /** @type {Scheduled} */ (/** @type {unknown} */ ({ recipe: "short", history: [missed, old] }));
  const rows = news([], "evening", { benches: [bench], schedule: [start] });
  assert.deepEqual(rows.map((row) => row.about).sort(), ["short", "triaxial"]);
  assert.ok(rows.every((row) => row.kind === "bad"));
});

test("a version that was made, certified or revoked is new; a draft of a campaign is listed once", () => {
  /** @type {CalibrationEvent[]} */
  const events = [
    { serial: "A", version: 2, act: "revoke", at: TONIGHT, by: "Bo", model: "m" },
    { serial: "A", version: 2, act: "certify", at: TONIGHT, by: "Ann", model: "m" },
    { serial: "A", version: 2, act: "made", at: TONIGHT, by: "", model: "bias_scale" },
    { serial: "A", version: 1, act: "made", at: LAST_WEEK, by: "", model: "bias_scale" },
    { serial: "B", version: 1, act: "made", at: TONIGHT, by: "", model: "m" },
  ];
  const drafts = /** @type {any} */ ([{ serial: "B", version: 1, certified: true, state: "made", report: null }]);
  assert.deepEqual(
    news([campaign({ drafts })], "evening", { events })
      .filter(({ campaign: of }) => of === null)
      .map(({ about, text, href }) => [about, text, href]),
    [
      ["A", "version 2 was revoked by Bo.", "/units/A"],
      ["A", "version 2 was certified by Ann.", "/units/A"],
      ["A", "version 2 was made: bias_scale.", "/explore?unit=A&version=2"],
    ],
  );
});
