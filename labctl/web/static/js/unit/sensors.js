// The accelerometer and the magnetometer of a unit: their versions, each with its coefficients, alignment and files.

import { download } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { button, card, chip, table } from "../core/components.js";
import { instant, personText, withUncertainty } from "../core/format.js";

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
        {
          title: "Stored",
          cell: (row) => h("div", { class: "nowrap" }, instant(row.at), h("br", {}), personText(row.by)),
        },
        { title: "Data", cell: (row) => row.data.files.map((file) => h("div", { title: file.sha256 }, file.name)) },
        { title: "Files", cell: files },
      ],
      [...versions],
      { label: "Versions of accelerometer and magnetometer" },
    ),
    ...versions.map((version, place) => coefficients(version, versions[place - 1]?.sensor !== version.sensor)),
  );
}

/**
 * The coefficients of a version with their expanded uncertainty, and those of its alignment.
 * @param {SensorVersion} version
 * @param {boolean} newest of its sensor: it is open at first
 */
function coefficients({ sensor, version, verdict, coefficients: rows }, newest) {
  const name = `${sensor[0]?.toUpperCase()}${sensor.slice(1)}, version ${version}`;
  return h(
    "details",
    { open: newest },
    h("summary", {}, verdict === "adequate" ? name : `${name}: ${verdict}`),
    table(
      [
        { title: "Coefficient", cell: (row) => row.name },
        {
          title: "Value ± U, 95.45 %",
          number: true,
          cell: (row) => withUncertainty(row.value, row.expanded, row.unit, row.name),
        },
      ],
      [...rows],
      { dense: true, label: name },
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
