// Entry point: the routes of all pages.

import { loadPlotly } from "./core/figure.js";
import { route, start } from "./core/router.js";
import { buildLayout } from "./core/layout.js";
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

route("/", () => import("./pages/start.js"));
route("/start", () => import("./pages/start.js"));
route("/bench", () => import("./pages/bench.js"));
route(
  "/live",
  withPlots(() => import("./pages/live.js")),
);
route("/campaigns", () => import("./pages/campaigns.js"));
route(
  "/campaigns/new",
  withPlots(() => import("./pages/campaign_new.js")),
);
route(
  "/campaigns/:id",
  withPlots(() => import("./pages/campaign.js")),
);
route("/units", () => import("./pages/units.js"));
route(
  "/units/:serial",
  withPlots(() => import("./pages/unit.js")),
);
route(
  "/explore",
  withPlots(() => import("./pages/explore.js")),
);
route("/recordings", () => import("./pages/recordings.js"));
route(
  "/recordings/:id",
  withPlots(() => import("./pages/recording.js")),
);
route(
  "/noise",
  withPlots(() => import("./pages/noise.js")),
);
route("/certificates", () => import("./pages/certificate.js"));
route("/effects", () => import("./pages/effects.js"));
route(
  "/effects/:id",
  withPlots(() => import("./pages/effects.js")),
);

buildLayout();
stopAgain();
await start();
// The first page is shown; the next one may need Plotly.
(window.requestIdleCallback ?? setTimeout)(preloadPlotly);
