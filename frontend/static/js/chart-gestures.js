// gestures(chart): zooming and panning of a plotly-chart, with Plotly's own box by the mouse (drag; with Shift it pans).
//
//   wheel     with Ctrl or ⌘ zooms (so does a pinch on a touchpad), sideways pans; plain it scrolls the page
//   touch     two fingers: what lies under them stays under them; one finger scrolls the page, a tap selects
//   keyboard  + − zoom, Shift+← → pan, Home End, 0 the whole chart; ← → and Escape are the cursor's (chart-cursor.js)
//
// chart has: plot (Plotly's element), axis (its x axis once drawn), view (chart-view.js), cursor, movable, words.

import { edge, extent } from "./plotly-inside.js";

const STEP = 0.7; // of the span, by a key or a button
const HINTED = "inband-chart-hint";
const NARROW = 48; // px between two fingers: above one another they only pan

// About the point that is selected, if it is in sight.
function middle({ view, cursor }) {
  const [low, high] = view.range;
  const at = cursor.at ? (cursor.at.x - low) / (high - low) : NaN;
  return at >= 0 && at <= 1 ? at : 0.5;
}

export const zoomIn = (chart) => chart.view.zoom(STEP, middle(chart));
export const zoomOut = (chart) => chart.view.zoom(1 / STEP, middle(chart));

// The share of the axis at a place of the screen; 0 is its left end.
function share(chart, clientX) {
  return (clientX - chart.plot.getBoundingClientRect().left - edge(chart.axis)) / extent(chart.axis);
}

// Once in a browser: a wheel that scrolls the page over a chart could zoom it.
function hint(chart) {
  if (localStorage.getItem(HINTED)) return;
  localStorage.setItem(HINTED, "yes");
  const words = chart.appendChild(Object.assign(document.createElement("div"), { className: "chart-hint", textContent: chart.words.hint }));
  setTimeout(() => words.remove(), 4_000);
}

function wheel(chart, event) {
  if (!chart.movable) return;
  const zooms = event.ctrlKey || event.metaKey;
  const sideways = event.shiftKey ? event.deltaY || event.deltaX : Math.abs(event.deltaX) > Math.abs(event.deltaY) && event.deltaX;
  if (!zooms && !(sideways && chart.view.shown)) {
    if (!sideways) hint(chart);
    return;
  }
  event.preventDefault();
  const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1;
  if (zooms) chart.view.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY * pixels)) * 0.005), Math.min(1, Math.max(0, share(chart, event.clientX))));
  else chart.view.pan((sideways * pixels) / extent(chart.axis));
}

function touches(chart) {
  let held = null; // the values under the two fingers, and the span, as they were put down

  function start(event) {
    held = null;
    if (event.touches.length !== 2 || !chart.movable) return;
    event.preventDefault();
    event.stopPropagation();
    const [low, high] = chart.view.range;
    held = { span: high - low, values: [...event.touches].map((touch) => low + (high - low) * share(chart, touch.clientX)) };
  }

  function move(event) {
    if (!held || event.touches.length !== 2) return;
    event.preventDefault();
    event.stopPropagation();
    const shares = [...event.touches].map((touch) => share(chart, touch.clientX));
    const apart = shares[1] - shares[0];
    const pinched = (held.values[1] - held.values[0]) / apart; // the span of the whole axis now
    const span = Math.abs(apart) * extent(chart.axis) > NARROW && pinched > 0 ? pinched : held.span;
    const low = (held.values[0] + held.values[1]) / 2 - (span * (shares[0] + shares[1])) / 2;
    chart.view.show([low, low + span], { write: false });
  }

  function end() {
    if (held) chart.view.write();
    held = null;
  }
  for (const [kind, listener] of [["touchstart", start], ["touchmove", move], ["touchend", end], ["touchcancel", end]]) {
    chart.plot.addEventListener(kind, listener, { capture: true, passive: false });
  }
}

function key(chart, event) {
  if (!chart.movable || event.ctrlKey || event.metaKey || event.altKey || event.target !== chart) return;
  const { view } = chart;
  const [low, high] = view.range;
  const [first, last] = view.whole;
  const action = {
    "+": () => zoomIn(chart),
    "=": () => zoomIn(chart),
    "-": () => zoomOut(chart),
    0: () => view.show(null),
    Home: () => view.show([first, first + high - low]),
    End: () => view.show([last - high + low, last]),
    ...(event.shiftKey && { ArrowLeft: () => view.pan(-0.25), ArrowRight: () => view.pan(0.25) }),
  }[event.key];
  if (!action) return;
  event.preventDefault();
  action();
}

export function gestures(chart) {
  chart.plot.addEventListener("wheel", (event) => wheel(chart, event), { capture: true, passive: false });
  chart.addEventListener("keydown", (event) => key(chart, event));
  touches(chart);
}
