// A point of a figure: what it is made of, and the same computed again from the raw readings, below the figure.

import { saveBlob } from "./http/api.js";
import { copyText } from "./copy_text.js";
import { csvText, fileName } from "./csv.js";
import { h, setChildren } from "./elements.js";
import { count, plainNumber } from "./format.js";
import { button, factList, loadInto, notice } from "./components.js";
import { reachByKeyboard } from "./keyboard_points.js";
import { drawnBy } from "./plotly.js";
import { query, updateQuery } from "./router.js";

/** @import { FigurePoint } from "../../../types/api.js" */
/** @import { Child, Figure } from "../../../types/pages.js" */

const DIGITS = 9;

/**
 * @typedef {object} Asked
 * @property {string} key its name in the address, after `point=`
 * @property {string} name
 * @property {() => Promise<FigurePoint>} read
 * @property {string} call of the Python client, `client.allan_point(...)`, that gives the same
 * @property {(point: FigurePoint) => Child} [links] to what the point is made of
 */

/**
 * A place for the point that is selected in a figure. `show(asked)` selects one and writes it into the address;
 * `open(asked)` does so where the address names it already.
 */
export function pointPlace() {
  const element = h("div", {});
  const close = () => {
    updateQuery({ point: null });
    setChildren(element);
  };
  /** @param {Asked} asked */
  function show(asked) {
    updateQuery({ point: asked.key });
    const card = h("section", { class: "stack notice", "aria-label": `Point: ${asked.name}` });
    setChildren(element, card);
    return loadInto(card, "Computing from the readings", async () => details(await asked.read(), asked, close));
  }
  /** @param {(key: string) => Asked | null} find */
  const open = (find) => {
    const { point } = query();
    const asked = point ? find(point) : null;
    if (asked) show(asked);
  };
  return { element, show, open, close };
}

/**
 * @param {FigurePoint} point
 * @param {Asked} asked
 * @param {() => void} close
 */
const details = (point, asked, close) => [
  h("h3", {}, point.title),
  point.formula ? h("p", { class: "formula" }, point.formula) : null,
  notice(point.equal === null ? "" : point.equal ? "good" : "bad", point.summary),
  factList([
    ...point.numbers.map(
      ({ name, unit, shown, recomputed }) =>
        /** @type {const} */ ([
          name,
          plainNumber(shown ?? recomputed, DIGITS),
          unit,
          shown === null || recomputed === null ? null : `from the readings: ${plainNumber(recomputed, DIGITS)}`,
        ]),
    ),
    ["Recording", point.recording, "", setsText(point)],
    point.readings_sha256
      ? [
          "SHA-256 of its readings",
          h("code", { class: "small digest" }, point.readings_sha256),
          "",
          `${count(point.readings)} readings`,
        ]
      : null,
  ]),
  h(
    "div",
    { class: "row" },
    button("Copy link", () => copyText(location.href, "Link to this point"), { kind: "tiny" }),
    button("Copy notebook cell", () => copyText(cellOf(asked.call, location.origin), "Notebook cell"), {
      kind: "tiny",
    }),
    button("Save as CSV", () => save(point), { kind: "tiny" }),
    asked.links?.(point),
    button("Close", close, { kind: "tiny" }),
  ),
];

/** @param {FigurePoint} point */
const setsText = ({ datasets: [first, last] }) =>
  !first ? null : first === last ? `data set ${first}` : `data sets ${first} to ${last}`;

/** @param {FigurePoint} point */
function save(point) {
  const rows = [
    ["number", "unit", "shown", "from_readings"],
    ...point.numbers.map(({ name, unit, shown, recomputed }) => [name, unit, shown, recomputed]),
  ];
  const head = `# ${point.title}; recording ${point.recording}; ${point.summary} SHA-256 ${point.readings_sha256 ?? "-"}\n`;
  saveBlob(new Blob([head + csvText(rows)], { type: "text/csv" }), `${fileName(point.title)}.csv`);
}

/**
 * @param {string} call
 * @param {string} origin
 */
export const cellOf = (call, origin) => `from labctl.client import Client

client = Client(${JSON.stringify(origin)})
point = ${call}
print(point.formula)
print(point.summary)
`;

/**
 * A value as Python writes it: text, number, None.
 * @param {string | number | null | undefined} value
 */
export const pythonValue = (value) => (value === null || value === undefined ? "None" : JSON.stringify(value));

/**
 * Select the points of a figure by a click, and by the keyboard. `asked(series, point)` names the point of a drawn trace.
 * @param {Figure} figure
 * @param {ReturnType<typeof pointPlace>} place
 * @param {(series: number, point: number) => Asked | null} asked
 */
export function selectPoints(figure, place, asked) {
  /** @param {number} series @param {number} point */
  const show = (series, point) => {
    const found = asked(series, point);
    if (found) place.show(found);
  };
  const { ondrawn } = figure;
  figure.ondrawn = (plot) => {
    ondrawn?.(plot);
    plot.on("plotly_click", ({ points: [point] }) => {
      if (point.curveNumber !== undefined && point.pointNumber !== undefined)
        show(point.curveNumber, point.pointNumber);
    });
  };
  const places = () =>
    (figure.plot.data ?? []).flatMap((trace, series) =>
      trace.hoverinfo === "skip" || trace.visible === "legendonly"
        ? []
        : Array.from(trace.x ?? [], (_, k) => k)
            .map((k) => ({ k, name: asked(series, k)?.name }))
            .filter(({ name }) => name)
            .map(({ k, name }) => ({ panel: 0, column: k, row: -series, sets: [series, k], text: String(name) })),
    );
  reachByKeyboard(figure, {
    places,
    onmove: (at) => {
      if (at) drawnBy(figure.plot).Fx.hover(figure.plot, [{ curveNumber: at.sets[0], pointNumber: at.sets[1] }]);
      else if (figure.plot.data) drawnBy(figure.plot).Fx.unhover(figure.plot);
    },
    onselect: ([series, k]) => (series === undefined ? place.close() : show(series, k)),
  });
}
