// Figures (Plotly's JSON, as the server makes it): how they are fetched, and what they say of their x axis.

import { afterEvent } from "./live.js";
import { theme } from "./theme-switch.js";

// Plotly shows times as they are written. They come in the time zone of the plant: without the offset they are its wall clock.
function wallClock(figure) {
  if (figure.layout.xaxis?.type !== "date") return figure;
  const local = (moment) => moment.replace(/(Z|[+-]\d\d:\d\d(:\d\d)?)$/, "");
  for (const trace of figure.data) trace.x = trace.x?.map(local);
  if (figure.layout.xaxis.range) figure.layout.xaxis.range = figure.layout.xaxis.range.map(local);
  for (const shape of figure.layout.shapes ?? []) {
    if (shape.xref !== "paper") Object.assign(shape, { x0: local(shape.x0), x1: local(shape.x1) });
  }
  return figure;
}


const FEW = 3; // readings: nothing narrower is shown
const SHORTEST = 10_000; // ms

const main = (trace) => (trace.xaxis ?? "x") === "x" && Array.isArray(trace.x);
export const valueOf = (x) => (typeof x === "number" ? x : Date.parse(`${x.replace(" ", "T")}Z`));

// The x axis can be zoomed: it is of numbers or times, and not tied to another axis.
export function isMovable({ data, layout }) {
  const axis = layout.xaxis ?? {};
  const tied = Object.keys(layout).some((name) => /^[xy]axis/.test(name) && (layout[name].scaleanchor || name === "xaxis2"));
  if (layout.dragmode === false || axis.fixedrange || axis.visible === false || tied || !["date", "linear", undefined].includes(axis.type)) return false;
  const first = data.find((trace) => main(trace) && trace.x.some((x) => x != null))?.x.find((x) => x != null);
  return axis.type === "date" ? typeof first === "string" : typeof first === "number";
}

// The whole axis: its ends, whether it is of dates, and the least that is shown of it. null: there is nothing to move in.
export function extentOf({ data, layout }) {
  const axis = layout.xaxis ?? {};
  const dates = axis.type === "date";
  let [low, high] = axis.range?.map(valueOf) ?? [Infinity, -Infinity];
  if (!axis.range) {
    for (const trace of data.filter(main)) {
      for (const x of trace.x) {
        if (x == null) continue;
        const value = valueOf(x);
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    const room = (high - low) * 0.03;
    [low, high] = [low - room, high + room];
  }
  if (!(low < high)) return null;
  return { whole: [low, high], dates, least: dates ? SHORTEST : axis.tickformat === "d" ? FEW : (high - low) / 1000 };
}

// Readings are drawn as blocks with their extremes, because there are too many of them.
export const isThinned = ({ data }) => data.some((trace) => ["extremes", "mean", "minimum"].includes(trace.meta));

// [[x, low, high], …] of what is drawn on the main axes, for a small picture of it.
export function courseOf({ data }) {
  const traces = data.filter((trace) => main(trace) && (trace.yaxis ?? "y") === "y" && trace.meta !== "newest" && Array.isArray(trace.y));
  const most = Math.max(...traces.map((trace) => trace.x.length));
  return traces.filter((trace) => trace.x.length > most / 4).flatMap((trace) =>
    trace.x.flatMap((x, n) => (x == null || typeof trace.y[n] !== "number" ? [] : [[valueOf(x), trace.y[n], trace.y[n]]])));
}

// The figure at an address; of a part [low, high] of its readings, with half as many on either side.
export async function fetchFigure(src, width, part = null) {
  const url = new URL(src, location.href);
  url.searchParams.set("theme", theme());
  url.searchParams.set("width", Math.max(200, Math.round(width)));
  if (part) {
    for (const name of ["last", "from", "to"]) url.searchParams.delete(name);
    const [low, high] = part;
    url.searchParams.set("first", Math.max(1, Math.floor(low - (high - low) / 2)));
    url.searchParams.set("through", Math.max(1, Math.ceil(high + (high - low) / 2)));
  }
  const answer = await fetch(url, { headers: { Accept: "application/json", ...afterEvent() }, signal: AbortSignal.timeout(60_000) });
  if (!answer.ok) throw new Error(`${answer.status}`);
  return wallClock(await answer.json());
}

// The layout with these ends of the x axis, which nothing but the view changes: no box across, nothing that Plotly keeps.
export function withRange(layout, range) {
  const axes = Object.entries(layout).filter(([name]) => name.startsWith("yaxis")).map(([name, axis]) => [name, { ...axis, fixedrange: true }]);
  return { ...layout, ...Object.fromEntries(axes), uirevision: false, xaxis: { ...layout.xaxis, autorange: false, range } };
}
