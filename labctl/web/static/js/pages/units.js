// The page of all units, by serial number.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { chip, emptyState, pageHeader, table } from "../core/components.js";

/** @import { PageContext } from "../../../types/pages.js" */

/** @param {PageContext} context */
export async function page({ signal }) {
  const units = await get("/api/units", { signal });
  /** @param {string} serial */
  const to = (serial) => `/units/${encodeURIComponent(serial)}`;
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Units",
      "Gyros by serial number, and which calibration of each is in force.",
      h("a", { class: "button", href: "/recordings" }, "Import a recording"),
    ),
    units.length
      ? h(
          "section",
          { class: "card" },
          table(
            [
              { title: "Serial number", cell: (unit) => h("a", { href: to(unit.serial) }, unit.serial) },
              { title: "Model", cell: (unit) => unit.model },
              { title: "Technology", cell: (unit) => unit.technology?.toUpperCase() ?? "–" },
              { title: "Recordings", number: true, cell: (unit) => unit.recordings.length },
              { title: "Versions", number: true, cell: (unit) => unit.calibrations.length },
              {
                title: "In force",
                cell: (unit) =>
                  unit.certified_version ? chip(`version ${unit.certified_version}`, "good") : chip("none", "warn"),
              },
              {
                title: "",
                cell: (unit) =>
                  h("a", { class: "button tiny", href: `/explore?unit=${encodeURIComponent(unit.serial)}` }, "Explore"),
              },
            ],
            units,
            { label: "Units" },
          ),
        )
      : emptyState(
          h("p", {}, "No unit has been measured or imported yet."),
          h("p", {}, h("a", { class: "button primary", href: "/start" }, "Begin")),
        ),
  );
}
