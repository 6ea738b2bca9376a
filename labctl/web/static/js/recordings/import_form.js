// Form to import a recording: drop or choose files, then show the answer of the service.

import { upload } from "../core/http/api.js";
import { messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { count } from "../core/format.js";
import { busyIndicator, notice, readOnlyNote } from "../core/components.js";
import { droppedFiles, isLog, recordingFiles } from "./file_input.js";
import { leftOutText } from "./leave_out.js";
import { logPreview } from "./log_preview.js";

/** @import { Imported } from "../../../types/api.js" */

const KINDS = ["rest", "rates", "turns", "profile", "poses"];

/** @param {readonly File[]} files */
const totalSize = (files) => {
  const bytes = files.reduce((sum, file) => sum + file.size, 0);
  return bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
};

/**
 * The import card; `taken(imported)` is called when a recording is in the database.
 * @param {(imported: Imported) => unknown} taken
 */
export function importForm(taken) {
  const result = h("div", { "aria-live": "polite" });
  /** @param {boolean} folder */
  const pick = (folder) => {
    /** @type {HTMLInputElement} */
    const input = h("input", {
      type: "file",
      multiple: true,
      webkitdirectory: folder,
      "aria-label": folder ? "Folder of a recording" : "Files of a recording",
      class: "visually-hidden",
      tabindex: "-1",
      onchange: () => {
        const files = [...(input.files ?? [])];
        input.value = "";
        if (files.length) take(folder ? recordingFiles(files) : { files, left: [] });
      },
    });
    return [
      h(
        "button",
        { type: "button", class: "button", onclick: () => input.click() },
        folder ? "Choose a folder" : "Choose files",
      ),
      input,
    ];
  };
  /** @type {HTMLElement} */
  const zone = h(
    "div",
    {
      class: "drop stack act",
      ondragover: over,
      ondragenter: over,
      ondragleave: (event) =>
        (event.relatedTarget instanceof Node && zone.contains(event.relatedTarget)) ||
        zone.classList.remove("dragover"),
      ondrop: async (event) => {
        event.preventDefault();
        zone.classList.remove("dragover");
        if (event.dataTransfer) take(await droppedFiles(event.dataTransfer));
      },
    },
    h("p", { class: "drop-title" }, "Drop a recording here"),
    h(
      "p",
      { class: "small" },
      h("code", {}, "recording.toml"),
      ", its data as CSV or Parquet, and the environment file if there is one; or the folder that holds them. Or a log: CSV, Parquet, PX4 ULog, ROS bag.",
    ),
    h("div", { class: "row", style: "justify-content: center" }, pick(false), pick(true)),
  );

  /** @param {DragEvent} event */
  function over(event) {
    event.preventDefault();
    zone.classList.add("dragover");
  }

  /** @param {{ files: File[], left: string[] }} chosen */
  async function take({ files, left }) {
    if (!files.length)
      return setChildren(
        result,
        refusedNotice(
          new Error(
            "None of these files is part of a recording. A recording needs recording.toml and one of samples, points or coefficients, as .csv or .parquet.",
          ),
        ),
      );
    if (isLog(files)) return setChildren(result, logPreview(files[0], accepted));
    setChildren(result, busyIndicator(`Reading ${files.map((file) => file.name).join(", ")} (${totalSize(files)})`));
    try {
      const made = await upload("/api/recordings", files);
      accepted(made, left);
    } catch (error) {
      setChildren(result, refusedNotice(error));
    }
    return result;
  }

  /**
   * @param {Imported} made
   * @param {readonly string[]} [left]
   */
  function accepted(made, left = []) {
    setChildren(result, acceptedNotice(made, left));
    taken(made);
  }

  return h(
    "section",
    { class: "card stack screen-only", "aria-label": "Import" },
    h("h2", {}, "Import"),
    readOnlyNote("Nothing is imported here"),
    zone,
    templates(),
    result,
  );
}

/** Templates of logs to download, one for each kind of data. */
const templates = () =>
  h(
    "p",
    { class: "small act" },
    "Templates of a log, with the columns for each way of moving the unit: ",
    KINDS.flatMap((kind, k) => [
      k ? ", " : null,
      h("a", { href: `/api/recordings/templates/${kind}`, download: `${kind}.csv` }, kind),
    ]),
    ".",
  );

/**
 * @param {Imported} made
 * @param {readonly string[]} left
 */
function acceptedNotice(made, left) {
  const warnings = made.warnings;
  return notice(
    warnings.length ? "bad" : "good",
    h(
      "p",
      { class: "lead" },
      `Imported as recording ${made.recording} of unit ${made.serial}: ${count(made.datasets)} data sets, ${count(made.readings)} readings.`,
    ),
    warnings.map((warning) => h("p", {}, `${warning.severity === "certain" ? "Wrong" : "Check"}: ${warning.text}`)),
    made.left_out.map((each) => h("p", { class: "small" }, leftOutText(each))),
    made.measured_at === null
      ? h(
          "p",
          { class: "small" },
          "The file states no date, so the date of the measurement is not known: trends and certificates leave the recording out. To state the date, import the file again with started_at in its column map.",
        )
      : null,
    left.length ? h("p", { class: "small" }, `Files not used: ${left.join(", ")}.`) : null,
    h(
      "div",
      { class: "row" },
      h(
        "a",
        {
          class: "button primary",
          href: `/explore?unit=${encodeURIComponent(made.serial)}&recording=${made.recording}`,
        },
        "Choose a model and fit",
      ),
      h("a", { class: "button", href: `/recordings/${made.recording}` }, "Show it"),
    ),
  );
}

/**
 * The error in large type: it names the file, column and row to correct.
 * @param {unknown} error
 */
function refusedNotice(error) {
  return notice(
    "bad",
    h("p", { class: "lead" }, messageOf(error)),
    h("p", { class: "small" }, "Nothing was imported."),
  );
}
