// The points of a plotly-chart that lead somewhere: those whose customdata is a link, or has one as its first item.
//
//   pointsOf(chart)                 by ascending x: {link, kind, curve, number, x, y, axis}; values as Plotly computes with them
//   nearest(chart, points, event)   the one under a finger or the mouse; null if none is near
//   pressed(plot, callback)         a click or a tap that was no drag

import { axisOf, place, valueOn } from "./plotly-inside.js";
import { here } from "./root.js";

const NEAR = { mouse: 24, pen: 24, touch: 44 }; // px
const MOVED = 8; // px; a press that moved further was a drag

const linkOf = (custom) => [custom].flat().slice(0, 1).filter((link) => typeof link === "string" && link.startsWith("/")).map(here)[0];

export function pointsOf({ plot }) {
  const across = axisOf(plot, "x");
  return plot.data.flatMap((trace, curve) => {
    const axis = axisOf(plot, trace.yaxis ?? "y");
    if (!axis || !across) return [];
    return (trace.customdata ?? []).flatMap((custom, number) => {
      const link = linkOf(custom);
      const [x, y] = [trace.x?.[number], trace.y?.[number]];
      return link && x != null && y != null ? [{ link, kind: trace.meta ?? curve, curve, number, x: valueOn(across, x), y: valueOn(axis, y), axis }] : [];
    });
  }).sort((one, other) => one.x - other.x);
}

// Where it stands in the plot.
export function pixels({ axis }, point) {
  return [place(axis, point.x), place(point.axis, point.y)];
}

export function nearest(chart, points, event) {
  const box = chart.plot.getBoundingClientRect();
  let found = null;
  let distance = NEAR[event.pointerType] ?? NEAR.mouse;
  for (const point of points) {
    const [x, y] = pixels(chart, point);
    const away = Math.hypot(event.clientX - box.left - x, event.clientY - box.top - y);
    if (away <= distance) [found, distance] = [point, away];
  }
  return found;
}

export function pressed(plot, callback) {
  plot.addEventListener("pointerdown", (down) => {
    if (down.button !== 0) return;
    let several = false;
    const more = () => { several = true; };
    const up = (event) => {
      if (event.pointerId !== down.pointerId) return;
      for (const kind of ["pointerup", "pointercancel"]) window.removeEventListener(kind, up, true);
      window.removeEventListener("pointerdown", more, true);
      const moved = Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
      if (event.type === "pointerup" && moved < MOVED && !several) callback(event);
    };
    for (const kind of ["pointerup", "pointercancel"]) window.addEventListener(kind, up, true);
    setTimeout(() => window.addEventListener("pointerdown", more, true)); // not this one
  }, { capture: true });
}
