// Entry point: the routes of all pages.

import { loadPlotly } from "./core/plotly.js";
import { route, start } from "./core/router.js";
import { buildLayout } from "./core/layout.js";
import { preparePrinting } from "./core/print.js";
import { stopAgain } from "./bench/actions.js";

/** @import { Route } from "./core/routes.js" */

/** Preload Plotly; a figure loads it again where that failed, and reports the error. */
const preloadPlotly = () => loadPlotly().catch(() => {});

/**
 * A page with plots: Plotly loads in parallel with the module and its requests.
 * @param {Route["load"]} load
 */
const withPlots = (load) => () => {
  preloadPlotly();
  return load();
};

route("/", "labctl", () => import("./pages/start.js"));
route("/start", "labctl", () => import("./pages/start.js"));
route("/bench", "Bench", () => import("./pages/bench.js"));
route(
  "/live",
  "Live calibration",
  withPlots(() => import("./pages/live.js")),
);
route("/campaigns", "Campaigns", () => import("./pages/campaigns.js"));
route(
  "/campaigns/new",
  "Plan a campaign",
  withPlots(() => import("./pages/campaign_new.js")),
);
route(
  "/campaigns/:id",
  "Campaign",
  withPlots(() => import("./pages/campaign.js")),
);
route(
  "/campaigns/:id/channels",
  "Channels",
  withPlots(() => import("./pages/channels.js")),
);
route("/units", "Units", () => import("./pages/units.js"));
route(
  "/units/:serial",
  "Unit",
  withPlots(() => import("./pages/unit.js")),
);
route(
  "/fleet",
  "Fleet",
  withPlots(() => import("./pages/fleet.js")),
);
route(
  "/explore",
  "Explore",
  withPlots(() => import("./pages/explore.js")),
);
route("/recordings", "Recordings", () => import("./pages/recordings.js"));
route(
  "/recordings/:id",
  "Recording",
  withPlots(() => import("./pages/recording.js")),
);
route(
  "/noise",
  "Noise",
  withPlots(() => import("./pages/noise.js")),
);
route(
  "/standards",
  "Reference standards",
  withPlots(() => import("./pages/standards.js")),
);
route("/certificates", "Certificate", () => import("./pages/certificate.js"));
route("/effects", "Effects", () => import("./pages/effects.js"));
route(
  "/effects/:id",
  "Effect",
  withPlots(() => import("./pages/effects.js")),
);

buildLayout();
preparePrinting();
stopAgain();
await start();
// The first page is shown; the next one may need Plotly.
(window.requestIdleCallback ?? setTimeout)(preloadPlotly);
