// A log before it is imported: the proposed map of its columns to correct, its first rows, a plot, and what is wrong.

import { sendFile } from "../core/http/api.js";
import { messageOf, Problem } from "../core/http/errors.js";
import { saveBlob } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { count, duration } from "../core/format.js";
import { actButton, busyIndicator, button, notice, table } from "../core/components.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { TECHNOLOGIES } from "../effects/labels.js";
import { choose, leaveOutChoices } from "./leave_out.js";
import { entryOf, logFields, withFact, withKey, withTarget, withUnit } from "./log_map.js";

/** @import { Imported, LogPreview } from "../../../types/api.js" */
/** @import { MapDocument } from "./log_map.js" */

/** @type {[string, string][]} */
const MOTIONS = [
  ["", "as found"],
  ["rest", "rest: nothing moves it"],
  ["rates", "rates: a table at one rate in each data set"],
  ["profile", "profile: a table whose rate changes"],
  ["turns", "turns: by a known angle in each data set"],
  ["poses", "poses: by hand, between rests"],
];
/** What effects a gyro can have, and of which size, depends on its technology. @type {[string, string][]} */
const KINDS_OF_GYRO = [["", "not stated"], ...Object.entries(TECHNOLOGIES)];
/** @type {[string, string][]} */
const DIVISIONS = [
  ["whole", "the whole file is one"],
  ["gaps", "a new one after each gap"],
  ["rests", "each rest is one"],
  ["column", "a new value of a column begins a new data set"],
];

/**
 * Show a log and let its map be corrected; `taken(imported)` is called when it is in the database.
 * @param {File} file
 * @param {(imported: Imported) => unknown} taken
 */
export function logPreview(file, taken) {
  const place = h("div", { class: "stack", "aria-live": "polite" });
  /** @type {string[]} */
  let options = [];
  /** @type {Set<string>} */
  const leaveOut = new Set();

  /** @param {MapDocument | string | null} map */
  const fields = (map) => logFields(map, { modified_ms: file.lastModified, options, leaveOut });

  /** @param {MapDocument | string | null} map */
  async function look(map) {
    setChildren(place, busyIndicator(`Inspecting ${file.name}`));
    try {
      show(await sendFile("/api/recordings/logs/preview", file, fields(map)));
    } catch (error) {
      setChildren(
        place,
        refused(error),
        map
          ? h(
              "div",
              { class: "row" },
              button("Propose a map again", () => look(null)),
            )
          : optionField(),
      );
    }
  }

  /** @param {LogPreview} seen */
  function show(seen) {
    /** @type {MapDocument} */
    const map = seen.column_map;
    const act = actButton(
      "Import",
      async () => {
        try {
          taken(await sendFile("/api/recordings/logs", file, fields(map)));
        } catch (error) {
          setChildren(
            place,
            refused(error),
            h(
              "div",
              { class: "row" },
              button("Look again", () => look(map)),
            ),
          );
        }
      },
      { kind: "primary" },
    );
    act.disabled = seen.problems.length > 0;
    setChildren(
      place,
      h("p", { class: "lead" }, `${seen.file}: ${seen.title}, ${count(seen.rows)} rows`),
      seen.problems.length ? problemList(seen.problems) : summary(seen),
      readingsNotice(seen, leaveOut, () => look(map)),
      seen.guesses.map((guess) => h("p", { class: "small" }, `Guessed: ${guess}`)),
      settings(seen, map, look),
      columnTable(seen, map, look),
      rowTable(seen),
      plot(seen, map),
      asText(seen, look),
      h(
        "div",
        { class: "row" },
        act,
        button("Save the map", () => saveMap(seen)),
      ),
    );
  }

  function optionField() {
    /** @type {HTMLInputElement} */
    const input = h("input", { type: "text", placeholder: "topic=/imu/data" });
    return h(
      "div",
      { class: "row" },
      labelledField(
        "Option of the importer",
        input,
        "KEY=VALUE, for example instance=1 for the second gyro of a ULog file.",
      ),
      button("Look again", () => {
        options = input.value.trim() ? [input.value.trim()] : [];
        return look(null);
      }),
    );
  }

  look(null);
  return place;
}

/** @param {unknown} error */
function refused(error) {
  const problems = error instanceof Problem ? (error.problems ?? []) : [];
  return notice(
    "bad",
    h("p", { class: "lead" }, messageOf(error)),
    problems.slice(1).map((line) => h("p", {}, line)),
    h("p", { class: "small" }, "Nothing was imported."),
  );
}

/** @param {readonly string[]} problems */
const problemList = (problems) =>
  notice(
    "bad",
    h(
      "p",
      { class: "lead" },
      problems.length === 1 ? "One thing is missing or wrong" : `${problems.length} things are missing or wrong`,
    ),
    problems.map((line) => h("p", {}, line)),
  );

/** @param {LogPreview} seen */
const summary = (seen) =>
  notice(
    "good",
    h(
      "p",
      {},
      `Unit ${seen.serial}, motion ${seen.motion}, ${count(seen.datasets ?? 0)} data set${seen.datasets === 1 ? "" : "s"}` +
        (seen.duration_s === null ? "." : `, ${duration(seen.duration_s)}.`),
    ),
    seen.unused.length ? h("p", { class: "small" }, `Not used: ${seen.unused.join(", ")}.`) : null,
  );

/**
 * What is wrong with single readings, and a choice for each kind that can be left out.
 * @param {LogPreview} seen
 * @param {Set<string>} chosen
 * @param {() => unknown} lookAgain
 */
function readingsNotice(seen, chosen, lookAgain) {
  if (!seen.warnings.length) return null;
  const choices = leaveOutChoices(seen.warnings, seen.rows).map(({ kind, text }) => {
    /** @type {HTMLInputElement} */
    const box = h("input", {
      type: "checkbox",
      checked: chosen.has(kind),
      onchange: () => {
        if (choose(chosen, kind, box.checked)) lookAgain();
      },
    });
    return h("label", { class: "check" }, box, text);
  });
  return notice(
    "bad",
    seen.warnings.map((each) => h("p", {}, `${each.severity === "certain" ? "Wrong" : "Check"}: ${each.text}`)),
    choices.length
      ? h("fieldset", { class: "stack" }, h("legend", {}, "Leave out of every fit (the readings are kept)"), choices)
      : null,
  );
}

/**
 * @param {LogPreview} seen
 * @param {MapDocument} map
 * @param {(map: MapDocument) => unknown} look
 */
function settings(seen, map, look) {
  /** @type {HTMLInputElement} */
  const serial = h("input", {
    type: "text",
    value: map.serial ?? "",
    onchange: () => look(withKey(map, "serial", serial.value.trim())),
  });
  /** @type {HTMLInputElement} */
  const rate = h("input", {
    type: "number",
    value: String(map.sample_rate_hz ?? ""),
    min: "0",
    step: "any",
    onchange: () => look(withKey(map, "sample_rate_hz", Number(rate.value) || null)),
  });
  /** @type {HTMLInputElement} */
  const type = h("input", {
    type: "text",
    value: map.info?.model ?? "",
    onchange: () => look(withFact(map, "model", type.value.trim())),
  });
  const by = map.datasets?.by ?? "whole";
  const columns = seen.columns.map((column) => option(column.name, column.name));
  return h(
    "div",
    { class: "row" },
    labelledField("Serial number", serial),
    labelledField("Type of the gyro", type, "As its manufacturer names it; certificates and the fleet state it."),
    selectField("Technology", KINDS_OF_GYRO, map.info?.technology ?? "", (value) =>
      look(withFact(map, "technology", value)),
    ),
    selectField("What moved it", MOTIONS, map.motion ?? "", (value) => look(withKey(map, "motion", value))),
    map.columns?.t_s
      ? null
      : labelledField("Readings per second", rate, "No column is mapped to the time; choose one."),
    selectField("Data sets", DIVISIONS, by, (value) =>
      look(withKey(map, "datasets", value === "column" ? { by: value, column: seen.columns[0].name } : { by: value })),
    ),
    by === "column"
      ? selectField("By the column", columns, map.datasets.column, (value) =>
          look(withKey(map, "datasets", { by, column: value })),
        )
      : null,
  );
}

/**
 * @param {LogPreview} seen
 * @param {MapDocument} map
 * @param {(map: MapDocument) => unknown} look
 */
function columnTable(seen, map, look) {
  const targets = [option("", "not used"), ...seen.targets.map((each) => option(each.name, each.name))];
  /** @typedef {LogPreview["columns"][number]} Row */
  /** @param {Row} row */
  const numberOf = (row) => seen.columns.indexOf(row) + 1;
  /** @param {Row} row */
  const entry = (row) => entryOf(map, row.name, numberOf(row));
  /** @param {Row} row */
  function unitCell(row) {
    const found = entry(row);
    const quantity = seen.targets.find((each) => each.name === found?.[0]);
    const [units, aliases] = [quantity?.units ?? [], quantity?.aliases ?? {}];
    if (!found || !units.length) return "–";
    const [target, { unit: stated = "", scale }] = found;
    const unit = aliases[stated.toLowerCase()] ?? stated; // dps is deg/s: listed once
    const shown = [option("", row.unit || "not given"), ...units.map((each) => option(each, each))];
    const known = unit === "" || units.includes(unit) ? shown : [...shown, option(unit, unit)];
    /** @type {HTMLInputElement} */
    const input = h("input", {
      type: "number",
      step: "any",
      value: String(scale ?? ""),
      "aria-label": `Converter counts (LSB) per unit of ${row.name}`,
      onchange: () => look(withUnit(map, target, "LSB", Number(input.value) || null)),
    });
    const choice = selectField(`Unit of ${row.name}`, known, unit, (value) => {
      if (value !== "LSB") return look(withUnit(map, target, value, null));
      map = withUnit(map, target, "LSB", null);
      return choice.after(input);
    });
    return [choice, unit === "LSB" ? input : null];
  }
  return table(
    [
      { title: "Column of the file", cell: (row) => h("strong", {}, row.name) },
      {
        title: "Is",
        cell: (row) =>
          selectField(`${row.name} is`, targets, entry(row)?.[0] ?? "", (value) =>
            look(withTarget(map, row.name, numberOf(row), value)),
          ),
      },
      { title: "In", cell: unitCell },
    ],
    seen.columns,
    { label: "Map of the columns", first: "11rem", dense: true },
  );
}

/** @param {LogPreview} seen */
const rowTable = (seen) =>
  table(
    seen.columns.map((column, k) => ({
      title: column.name,
      number: !column.is_text,
      /** @param {string[]} row */
      cell: (row) => row[k] ?? "",
    })),
    seen.first_rows,
    { label: "First rows", dense: true },
  );

/**
 * @param {LogPreview} seen
 * @param {MapDocument} map
 */
function plot(seen, map) {
  const used = seen.traces.filter((trace) => {
    const column = seen.columns.findIndex((each) => each.name === trace.name);
    return entryOf(map, trace.name, column + 1)?.[0].startsWith("gyro_");
  });
  const shown = used.length ? used : seen.traces.slice(0, 6);
  if (!shown.length) return null;
  const draw = () => ({
    data: shown.map((trace, k) => ({
      type: "scatter",
      mode: "lines",
      x: trace.x.flatMap((x) => [x, x]),
      y: trace.low.flatMap((low, row) => [low, trace.high[row]]),
      line: { width: 1.2, color: used.length ? axisColour("xyz"[k]) : colour(["axis-x", "axis-y", "axis-z"][k % 3]) },
      name: trace.name,
    })),
    layout: {
      xaxis: { title: { text: seen.motion ? "time, s" : "row, or time in s where it is known" } },
      yaxis: { title: { text: shown.length > 1 ? "value in the file" : `${shown[0].name}, as in the file` } },
      margin: { l: 70, r: 12, t: 8, b: 46 },
    },
  });
  return figure(
    `Columns of ${seen.file}`,
    "Smallest and largest value in each of up to 300 sections of the file, in the file's units.",
    draw,
    {
      height: "18rem",
    },
  );
}

/**
 * @param {LogPreview} seen
 * @param {(map: string) => unknown} look
 */
function asText(seen, look) {
  const text = h("textarea", {
    rows: "14",
    spellcheck: "false",
    value: seen.map_toml,
    "aria-label": "The map as TOML",
  });
  return h(
    "details",
    {},
    h("summary", {}, "The column map as TOML: parts, constants and every other key"),
    text,
    h(
      "div",
      { class: "row" },
      button("Check this map", () => look(text.value)),
    ),
  );
}

/** @param {LogPreview} seen */
async function saveMap(seen) {
  saveBlob(new Blob([seen.map_toml], { type: "application/toml" }), `${seen.file.replace(/\.\w+$/, "")}.map.toml`);
}
