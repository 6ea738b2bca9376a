// The data sets of a recording as a table with pages and a selection.

import { setChildren, h } from "../core/elements.js";
import { count, duration, mean, number, plainNumber, scatterText } from "../core/format.js";
import { chip, cardWithHeader, table } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { updateQuery } from "../core/router.js";
import { channelName, channelUnit } from "./channels.js";
import { POSITIONED, RATE_TITLES } from "./motion_texts.js";

/** @import { Query, RecordingState } from "../../../types/pages.js" */

const PAGE_SIZE = 25;
/** @type {Record<string, string>} */
const CHIP_KINDS = { complete: "good", running: "accent", open: "accent" };

/**
 * `state` has {sets, dataset, pick(number), output}; `asked` are the position and the page (from 1) of the address.
 * @param {RecordingState} state
 * @param {Query} asked
 */
export function datasetTable(state, asked) {
  const { sets } = state;
  const place = h("div", {});
  const leaf = h("div", { class: "row" });
  let position = asked.position ?? "";
  /** @type {number | null} */
  let at = Number(asked.page) || null;

  function show() {
    const rows = sets.number.map((_, k) => k).filter((k) => !position || sets.position[k] === position);
    const pages = Math.max(1, Math.ceil(rows.length / PAGE_SIZE));
    const picked = rows.findIndex((k) => sets.number[k] === state.dataset);
    const shown = Math.min(Math.max(at ?? (picked >= 0 ? Math.floor(picked / PAGE_SIZE) + 1 : 1), 1), pages);
    at = shown;
    setChildren(place, pageTable(state, rows.slice((shown - 1) * PAGE_SIZE, shown * PAGE_SIZE)));
    /**
     * @param {string} text
     * @param {string} label
     * @param {number} to
     */
    const turn = (text, label, to) =>
      h(
        "button",
        {
          type: "button",
          class: "button tiny",
          "aria-label": label,
          disabled: to < 1 || to > pages,
          onclick: () => {
            at = to;
            updateQuery({ page: at === 1 ? null : at });
            show();
          },
        },
        text,
      );
    setChildren(
      leaf,
      pages > 1
        ? [
            turn("« First", "First page", shown === 1 ? 0 : 1),
            turn("‹ Back", "Previous page", shown - 1),
            h("span", { class: "muted small", "aria-live": "polite" }, `${shown} of ${pages}`),
            turn("On ›", "Next page", shown + 1),
            turn("Last »", "Last page", shown === pages ? 0 : pages),
          ]
        : null,
    );
  }
  show();
  const positions = [...new Set(sets.position)];
  const filter =
    positions.length > 1
      ? selectField(
          "Position",
          [["", "all"], ...positions.map((each) => option(each, `${each} up`))],
          position,
          (value) => {
            position = value;
            at = 1;
            updateQuery({ position, page: null });
            show();
          },
        )
      : null;
  const redraw = () => {
    at = null;
    show();
  };
  return Object.assign(
    cardWithHeader(
      `${count(sets.number.length)} data ${sets.number.length === 1 ? "set" : "sets"}`,
      filter,
      place,
      leaf,
    ),
    { redraw },
  );
}

/**
 * @param {RecordingState} state
 * @param {readonly number[]} rows
 */
function pageTable(state, rows) {
  const { sets, output } = state;
  const gyros = Object.keys(sets.channels).filter((name) => name.startsWith("gyro_"));
  /**
   * @param {string} name
   * @param {number} k
   * @param {number} digits
   */
  const of = (name, k, digits) => (sets.channels[name] ? number(sets.channels[name].mean[k], digits) : "–");
  const timed = sets.t_from_s.some((t) => t !== null);
  const warm = sets.chamber_setpoint_c.some((t) => t !== null);
  return table(
    [
      {
        title: "Data set",
        cell: (k) =>
          h(
            "button",
            {
              type: "button",
              class: "button tiny",
              "aria-pressed": String(sets.number[k] === state.dataset),
              onclick: (event) => {
                event.stopPropagation();
                state.pick(sets.number[k]);
              },
            },
            `${sets.number[k]}`,
          ),
      },
      {
        title: "State",
        cell: (k) => h("span", { title: sets.reason[k] }, chip(sets.state[k], CHIP_KINDS[sets.state[k]] ?? "warn")),
      },
      POSITIONED.has(state.motion) ? { title: "Up", cell: (k) => sets.position[k] } : null,
      RATE_TITLES[state.motion]
        ? {
            title: `${RATE_TITLES[state.motion]}, deg/s`,
            number: true,
            cell: (k) => plainNumber(sets.table_rate_dps[k], 6),
          }
        : null,
      warm
        ? { title: "Set point, °C", number: true, cell: (k) => plainNumber(sets.chamber_setpoint_c[k] ?? NaN) }
        : null,
      sets.channels.temperature_c ? { title: "Gyro, °C", number: true, cell: (k) => of("temperature_c", k, 4) } : null,
      ...gyros.map((name) => ({
        title: `${channelName(name).replace("gyro output", "Output")}, ${channelUnit(name, output)}`,
        number: true,
        /** @param {number} k */
        cell: (k) => [
          mean(sets.channels[name].mean[k], sets.channels[name].std[k]),
          sets.channels[name].std[k] === null
            ? null
            : h(
                "span",
                { class: "muted small secondary", title: "standard deviation of one reading" },
                ` ${scatterText(sets.channels[name].std[k])}`,
              ),
        ],
      })),
      { title: "Readings", number: true, cell: (k) => (state.kind === "samples" ? count(sets.n[k]) : "–") },
      timed ? { title: "Begins after", number: true, cell: (k) => duration(sets.t_from_s[k] ?? NaN) } : null,
    ],
    rows,
    {
      dense: true,
      label: "Data sets",
      selected: (k) => sets.number[k] === state.dataset,
      onrow: (k) => state.pick(sets.number[k]),
    },
  );
}
