// Noise at rest: Allan deviation of each axis, and N, B and K with the reason where one has no value.

import { get } from "../core/http/api.js";
import { Problem } from "../core/http/errors.js";
import { setChildren, h, whenNearViewport } from "../core/elements.js";
import { faded } from "../core/colour_scales.js";
import { axisColour, figure } from "../core/figure.js";
import { duration, number, withUnit } from "../core/format.js";
import { ticksOf } from "../core/log_ticks.js";
import { cardWithHeader, loadInto, notice, table } from "../core/components.js";
import { toggleGroup } from "../core/fields.js";
import { pointPlace, pythonValue, selectPoints } from "../core/figure_point.js";

/** @import { Allan, AllanAxis, NoiseFigure } from "../../../types/api.js" */
/** @import { RecordingState } from "../../../types/pages.js" */
/** @import { Asked } from "../core/figure_point.js" */

/** Of each axis are drawn: the interval, the fit, the deviation. */
const TRACES_OF_AXIS = 3;

/** @type {["N" | "B" | "K", string][]} */
export const NOISE_FIGURES = [
  ["N", "angle random walk"],
  ["B", "bias instability"],
  ["K", "rate random walk"],
];

/**
 * Card for the longest section at rest, or for the selected data set.
 * @param {RecordingState} state
 * @param {AbortSignal} signal
 */
export function allan(state, signal) {
  const place = h("div", { class: "stack" });
  const which = h("div", {});
  let [own, seen] = [false, false];
  const show = () => {
    if (!seen) return; // the readings at rest are loaded only when the card is near the viewport
    setChildren(
      which,
      state.dataset
        ? toggleGroup(
            "Data",
            [
              ["rest", "longest section at rest"],
              ["set", `data set ${state.dataset}`],
            ],
            own ? "set" : "rest",
            (value) => {
              own = value === "set";
              show();
            },
          )
        : null,
    );
    const dataset = own ? state.dataset : null;
    loadInto(place, "Working out the Allan deviation", async () => {
      try {
        return allanFigure(
          own ? state.dataset : null,
          await get("/api/recordings/{recording}/allan", { path: { recording: state.id }, query: { dataset }, signal }),
        );
      } catch (error) {
        if (error instanceof Problem && error.status < 500) return notice("", error.message); // too little at rest is no fault
        throw error;
      }
    });
  };
  const element = cardWithHeader("Noise at rest", which, place);
  whenNearViewport(element, () => {
    seen = true;
    show();
  });
  return Object.assign(element, { redraw: show });
}

/**
 * @param {number | null} dataset whose deviation it is; null: of the longest section at rest
 * @param {Allan} found
 */
function allanFigure(dataset, found) {
  const axes = Object.entries(found.axes);
  const [first, last] = [found.datasets[0], found.datasets.at(-1)];
  const where = `Data set${first === last ? ` ${first}` : `s ${first} to ${last}`}, ${duration(found.duration_s)}${found.temperature_c === null ? "" : ` at ${withUnit(found.temperature_c, "°C")}`}.`;
  const draw = () => ({
    data: axes.flatMap(([axis, noise]) => [
      {
        type: "scatter",
        mode: "lines",
        x: [...noise.tau_s, ...[...noise.tau_s].reverse()],
        y: [...noise.high_dps, ...[...noise.low_dps].reverse()],
        fill: "toself",
        fillcolor: faded(axisColour(axis), 0.18),
        line: { width: 0 },
        hoverinfo: "skip",
        showlegend: false,
        name: `${axis}, 95 %`,
      },
      {
        type: "scatter",
        mode: "lines",
        x: noise.tau_s,
        y: noise.model_dps,
        line: { color: axisColour(axis), dash: "dot", width: 1.2 },
        hoverinfo: "skip",
        showlegend: false,
        name: `${axis}, fitted`,
      },
      {
        type: "scatter",
        mode: "lines+markers",
        x: noise.tau_s,
        y: noise.deviation_dps,
        line: { color: axisColour(axis), width: 2 },
        marker: { size: 5 },
        name: `axis ${axis}`,
        hovertemplate: `${axis}: %{y:.3~g} deg/s over %{x:.3~g} s<extra></extra>`,
      },
    ]),
    layout: {
      xaxis: { type: "log", title: { text: "averaging time, s" } },
      yaxis: {
        type: "log",
        title: { text: "Allan deviation, deg/s" },
        ...ticksOf(axes.flatMap(([, noise]) => noise.deviation_dps)),
      },
      margin: { l: 70, r: 12, t: 8, b: 46 },
    },
  });
  const csv = () => [
    ["axis", "tau_s", "deviation_dps", "low_dps", "high_dps", "model_dps"],
    ...axes.flatMap(([axis, noise]) =>
      noise.tau_s.map((tau, k) => [
        axis,
        tau,
        noise.deviation_dps[k],
        noise.low_dps[k],
        noise.high_dps[k],
        noise.model_dps[k],
      ]),
    ),
  ];
  const place = pointPlace();
  const drawn = figure(
    `Recording ${found.recording} Allan deviation`,
    "Band: 95 % interval. Dotted: the fit that gives angle random walk N, bias instability B and rate random walk K. Click a point to see the clusters of readings it is made of.",
    draw,
    { height: "21rem", csv },
  );
  /** @param {number} series @param {number} k */
  const asked = (series, k) => {
    const [axis, noise] = axes[Math.floor(series / TRACES_OF_AXIS)];
    return series % TRACES_OF_AXIS === TRACES_OF_AXIS - 1
      ? allanPoint(Number(found.recording), axis, noise.tau_s[k], dataset)
      : null;
  };
  selectPoints(drawn, place, asked);
  place.open((key) => askedAllan(key, Number(found.recording), dataset, found));
  return [
    h("p", { class: "muted" }, where),
    ...axes.flatMap(([axis, noise]) =>
      remarks(noise).map((text) => h("p", { class: "muted small" }, `${axis}: ${text}`)),
    ),
    drawn,
    place.element,
    table(
      [
        {
          title: "Figure",
          cell: ([id, name]) => [h("strong", {}, id), h("span", { class: "muted nowrap" }, `, ${name}`)],
        },
        ...axes.map(([axis, noise]) => ({
          title: `Axis ${axis}`,
          /** @param {typeof NOISE_FIGURES[number]} row */
          cell: ([id]) => noiseFigure(noise[id]),
        })),
      ],
      NOISE_FIGURES,
      { label: "Figures of IEEE Std 952", first: "11rem" },
    ),
  ];
}

/**
 * A point of an Allan deviation.
 * @param {number} recording
 * @param {string} axis
 * @param {number | null} tau averaging time, s
 * @param {number | null} dataset
 * @returns {Asked | null}
 */
export function allanPoint(recording, axis, tau, dataset = null) {
  if (tau === null) return null;
  const asked = { axis, tau_s: tau, dataset: dataset ?? undefined };
  const of = dataset === null ? "" : `, dataset=${dataset}`;
  return {
    key: ["allan", recording, axis, tau, ...(dataset === null ? [] : [dataset])].join("_"),
    name: `Allan deviation of recording ${recording}, axis ${axis}, averaging time ${number(tau)} s`,
    read: () => get("/api/recordings/{recording}/allan/point", { path: { recording }, query: asked }),
    call: `client.allan_point(${recording}, axis=${pythonValue(axis)}, tau_s=${tau}${of})`,
    links: ({ datasets: [first] }) =>
      h("a", { class: "button tiny", href: `/recordings/${recording}?dataset=${first}` }, "Open its readings"),
  };
}

/**
 * The point of an Allan deviation that an address names; null where it names another one.
 * @param {string} key
 * @param {number} recording
 * @param {number | null} dataset
 * @param {Allan} found
 */
export function askedAllan(key, recording, dataset, found) {
  const all = Object.entries(found.axes).flatMap(([axis, noise]) =>
    noise.tau_s.map((tau) => allanPoint(recording, axis, tau, dataset)),
  );
  return all.find((each) => each?.key === key) ?? null;
}

/**
 * What keeps the figures of an axis from resting on every averaging time.
 * @param {AllanAxis} noise
 */
function remarks(noise) {
  const said = [];
  if (noise.from_s !== undefined)
    said.push(
      `N, B and K are of averaging times from ${duration(noise.from_s)} on; shorter ones do not follow the terms.`,
    );
  if (noise.smoothing_s !== undefined)
    said.push(
      `An output filter smooths over ${withUnit(noise.smoothing_s, "s")}; N is that of averaging times well above.`,
    );
  if (noise.step_dps !== undefined)
    said.push(
      `The output has steps of ${withUnit(noise.step_dps, "deg/s")}, larger than its noise; bounds allow for half a step.`,
    );
  return said;
}

/**
 * A noise figure with its uncertainty, or its upper bound and the reason why it has no value.
 * @param {NoiseFigure | null | undefined} noise
 */
function noiseFigure(noise) {
  if (noise?.value !== null && noise?.value !== undefined)
    return [
      h("strong", { class: "nowrap" }, `${number(noise.value)} ${noise.unit}`),
      h("span", { class: "muted small secondary" }, `u = ${number(noise.u, 2)} ${noise.unit}`),
    ];
  return [
    h(
      "span",
      { class: "muted nowrap" },
      noise?.at_most ? `below ${number(noise.at_most, 2)} ${noise.unit}` : "not seen",
    ),
    noise?.why ? h("span", { class: "muted small secondary" }, noise.why) : null,
  ];
}
