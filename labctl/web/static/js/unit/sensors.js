// The accelerometer and the magnetometer of a unit: their versions, and each as a file.

import { download } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { button, card, chip, table } from "../core/components.js";
import { instant } from "../core/format.js";

/** @import { SensorVersion } from "../../../types/api.js" */

/**
 * A card of all versions; null for a unit without one.
 * @param {readonly SensorVersion[]} versions by sensor, newest first
 */
export function sensorsCard(versions) {
  if (!versions.length) return null;
  return card(
    "Accelerometer and magnetometer",
    table(
      [
        { title: "Sensor", cell: (row) => row.sensor },
        { title: "Version", number: true, cell: (row) => `${row.version}` },
        { title: "Verdict", cell: (row) => chip(row.verdict, row.verdict === "adequate" ? "good" : "warn") },
        { title: "Result", prose: true, cell: (row) => row.summary.join(" ") },
        { title: "Stored", cell: (row) => h("div", { class: "nowrap" }, instant(row.at), h("br", {}), row.by) },
        { title: "Data", cell: (row) => row.data.files.map((file) => h("div", { title: file.sha256 }, file.name)) },
        { title: "Files", cell: files },
      ],
      [...versions],
      { label: "Versions of accelerometer and magnetometer" },
    ),
  );
}

/** @param {SensorVersion} row */
function files({ serial, sensor, version, formats }) {
  return h(
    "div",
    { class: "row tight" },
    formats.map(({ id, title, suffix }) =>
      button(
        title,
        async () => {
          const query = { format: id, version };
          const name = `${serial}-${sensor}-v${version}.${suffix}`;
          await download("/api/units/{serial}/sensors/{sensor}/file", name, { path: { serial, sensor }, query });
        },
        { kind: "tiny" },
      ),
    ),
  );
}
