// Which module shows which address.

import { plotly } from "./core/figure.js";
import { route, start } from "./core/router.js";
import { shell } from "./core/layout.js";

/** Begin to load what draws pictures; a picture that then lacks it asks again, and says so. */
const pencils = () => plotly().catch(() => {});

/** A page with pictures: what draws them loads beside the page and what it asks for. */
const drawn = (load) => () => {
  pencils();
  return load();
};

route("/", () => import("./pages/start.js"));
route("/start", () => import("./pages/start.js"));
route("/bench", () => import("./pages/bench.js"));
route("/campaigns", () => import("./pages/campaigns.js"));
route("/campaigns/new", drawn(() => import("./pages/campaign_new.js")));
route("/campaigns/:id", drawn(() => import("./pages/campaign.js")));
route("/units", () => import("./pages/units.js"));
route("/units/:serial", drawn(() => import("./pages/unit.js")));
route("/explore", drawn(() => import("./pages/explore.js")));
route("/recordings", () => import("./pages/recordings.js"));
route("/recordings/:id", drawn(() => import("./pages/recording.js")));
route("/effects", () => import("./pages/effects.js"));
route("/effects/:id", drawn(() => import("./pages/effects.js")));

shell();
await start();
// The first page stands: the next may have pictures.
(window.requestIdleCallback ?? setTimeout)(pencils);
