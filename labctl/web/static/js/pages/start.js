// The start page: an overview, or, with an empty database, the ways to begin.

import { get, getPart, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { percent } from "../core/format.js";
import { actButton, card, pageHeader } from "../core/components.js";
import { NO_BENCH } from "../core/no_bench.js";
import { presentWords } from "../core/freshness/line.js";
import { navigate } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { errorSparkline } from "../core/sparkline.js";
import { isRunning } from "../campaigns/states.js";
import { NEWEST, newsCard } from "../start/news_card.js";
import { realGyroPicture } from "../start/real_gyro.js";
import { DUE_SHOWN, DUE_WITHIN, dueNotice } from "../unit/due.js";

/** @import { Part } from "../core/long_list.js" */
/** @import { Unit } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** The example of a real gyro, and the model that it is fitted with first. */
const EXAMPLE = { name: "osu-fog", serial: "OSU-FOG-2024", datasets: 695, model: "bias_scale" };
/** Units that are listed. */
const SHOWN = 6;

/** @param {PageContext} context */
export async function page({ signal }) {
  const [units, due, campaigns, benches, schedule, events] = await Promise.all([
    get("/api/units", { query: { limit: SHOWN }, signal }),
    getPart("/api/units", { query: { due_within: DUE_WITHIN, limit: DUE_SHOWN }, signal }),
    get("/api/campaigns", { query: { limit: NEWEST }, signal }),
    get("/api/benches", { signal }),
    get("/api/schedule", { signal }),
    get("/api/calibration-events", { signal }),
  ]);
  if (units.length || campaigns.length) return overview(units, { due, campaigns, benches, schedule, events });
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Begin",
      "labctl calibrates gyroscopes: it drives a rate table and a thermal chamber, fits an error model and serves the calibration. It compares the model with the measurements, shows which physical effect is missing, and the error falls when that effect is added.",
    ),
    card(
      "On a real gyro",
      realGyroPicture(),
      h(
        "p",
        {},
        "695 data sets (mean outputs, each at a constant rate and temperature) from a heated rate table, with a first model fitted. Its error is sixteen times the noise; find out why, correct the model, and certify it. The tour leads through this in five steps.",
      ),
      h(
        "div",
        { class: "row" },
        actButton("Open the real gyro", () => openExample(), { kind: "primary" }),
        actButton("Take the tour", () => openExample("1")),
      ),
    ),
    h("h2", {}, "Other ways to begin"),
    h(
      "div",
      { class: "columns" },
      card(
        "Find a hidden effect",
        h(
          "p",
          {},
          "A simulated gyro with an effect that its data sheet does not mention: 121 data sets, fitted with a published model. Find out which effect the model lacks.",
        ),
        actButton("Simulate a hidden effect", openSimulated),
      ),
      card(
        "Import your own data",
        h(
          "p",
          {},
          "A log of readings: CSV with any columns, Parquet, PX4 ULog or a ROS bag. Or a folder in the format of labctl: recording.toml and its data file.",
        ),
        h("a", { class: "button", href: "/recordings" }, "Import a recording"),
      ),
      benches.length
        ? card(
            `Run a campaign on ${benches[0].name}`,
            h(
              "p",
              {},
              `${benches[0].simulated ? "A simulated bench: nothing real moves. " : ""}Choose a recipe, see which effects it can detect, and start.`,
            ),
            h("a", { class: "button", href: "/campaigns/new" }, "Plan a campaign"),
          )
        : null,
    ),
  );
}

/** Simulate a recording, fit it, and open it on the explore page. */
async function openSimulated() {
  const made = await post("/api/recordings/simulated", {
    body: { recipe: "ojeda2000-121", hide: ["scale_factor_asymmetry=0.0002"], seed: 1 },
  });
  await openExplore(made.serial, made.recording, "ojeda2000");
}

/**
 * Open the example; it is imported and fitted once. The tour begins at the first model, otherwise the newest version is
 * shown.
 * @param {string | null} [tour] the step of the tour that is shown
 */
async function openExample(tour = null) {
  const { name, serial, datasets, model } = EXAMPLE;
  const recordings = await get("/api/recordings", { query: { unit: serial } });
  const known = recordings.filter((each) => each.origin === "import" && each.datasets === datasets).at(-1)?.id;
  if (known === undefined) {
    const made = await post("/api/recordings/example", { body: { name } });
    return openExplore(made.serial, made.recording, model, tour);
  }
  const versions = await get("/api/units/{serial}/calibrations", { path: { serial } });
  const version = (tour ? versions.filter((each) => each.model === model).at(-1) : versions[0])?.version;
  if (!version) return openExplore(serial, known, model, tour);
  return navigate(`/explore?${changedQuery("", { unit: serial, version, recording: known, tour })}`);
}

/**
 * @param {string} serial
 * @param {number} recording
 * @param {string} model
 * @param {string | null} [tour]
 */
async function openExplore(serial, recording, model, tour = null) {
  const fitted = await post("/api/units/{serial}/calibrations", { path: { serial }, body: { recording, model } });
  const shown = { unit: serial, version: fitted.version, recording, tour };
  await navigate(`/explore?${changedQuery("", shown)}`);
}

/**
 * @param {readonly Unit[]} units
 * @param {Parameters<typeof newsCard>[0] & { due: Part<Unit> }} found
 */
function overview(units, found) {
  const { due, campaigns, benches } = found;
  const running = campaigns.find(isRunning);
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "labctl",
      "Compare the model with the measurements: where it fails, which effects are missing, and how the error falls when they are added.",
    ),
    dueNotice(due, benches),
    newsCard(found),
    h(
      "div",
      { class: "columns", style: "--column-min: 20rem" },
      card(
        "Bench",
        benches.length
          ? h(
              "p",
              {},
              presentWords(
                running
                  ? `Campaign ${running.id} (${running.recipe}) is ${running.state}, ${percent(running.progress)} done.`
                  : benches[0].unconfirmed
                    ? `${benches[0].name} was not confirmed safe; inspect the bench.`
                    : `${benches[0].name} is free.`,
              ),
            )
          : h("p", {}, `${NO_BENCH}.`),
        h(
          "div",
          { class: "buttons" },
          h("a", { class: "button primary", href: "/bench" }, "To the bench"),
          h("a", { class: "button", href: "/campaigns/new" }, "Plan a campaign"),
          h("a", { class: "button act", href: "/live" }, "Calibrate live"),
        ),
      ),
      card(
        "Units",
        h(
          "ul",
          { class: "plain unit-lines" },
          units.map((unit) =>
            h(
              "li",
              {},
              h("a", { class: "serial", href: `/units/${encodeURIComponent(unit.serial)}` }, unit.serial),
              unit.calibrations.length ? errorSparkline(unit.newest_errors) : h("span"),
              h("a", { class: "button tiny", href: `/explore?unit=${encodeURIComponent(unit.serial)}` }, "Explore"),
            ),
          ),
        ),
        units.some((unit) => unit.calibrations.length)
          ? h(
              "p",
              { class: "muted small" },
              "Lines: error of each version over the noise floor (dashed); number: that of the newest version, in noise floors.",
            )
          : null,
        units.length === SHOWN ? h("a", { class: "small", href: "/units" }, "All units") : null,
      ),
      card(
        "Data",
        h(
          "div",
          { class: "buttons" },
          h("a", { class: "button act", href: "/recordings" }, "Import a recording"),
          h("a", { class: "button", href: "/recordings" }, "All recordings"),
          actButton("Simulate a hidden effect", openSimulated),
          actButton("Open the real gyro", () => openExample()),
          actButton("Take the tour", () => openExample("1")),
        ),
      ),
    ),
  );
}
