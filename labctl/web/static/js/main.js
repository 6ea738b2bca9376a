// Which module shows which address.

import { route, start } from "./core/router.js";
import { shell } from "./core/shell.js";

route("/", () => import("./pages/start.js"));
route("/start", () => import("./pages/start.js"));
route("/bench", () => import("./pages/bench.js"));
route("/campaigns", () => import("./pages/campaigns.js"));
route("/campaigns/new", () => import("./pages/campaign-new.js"));
route("/campaigns/:id", () => import("./pages/campaign.js"));
route("/units", () => import("./pages/units.js"));
route("/units/:serial", () => import("./pages/unit.js"));
route("/explore", () => import("./pages/explore.js"));
route("/recordings", () => import("./pages/recordings.js"));
route("/recordings/:id", () => import("./pages/recording.js"));
route("/effects", () => import("./pages/effects.js"));
route("/effects/:id", () => import("./pages/effects.js"));

shell();
start();
