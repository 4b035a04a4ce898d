// ChartCursor: the point of a plotly-chart that is selected, with a ring about it and a panel beside the chart.
//
// Points are those whose customdata is a link (or has one as its first item). A click, a tap, or ← → selects one; the panel
// (chart-panel.js) says what it is, and only its link opens the page. Charts of one page whose x axes say the same thing share
// a line where one of them is looked at.
//
//   new ChartCursor(chart, words)   chart has: plot (Plotly's element), axis, view, touch
//   redraw()                        the chart has new content     place()   … or another part of it is shown

import { ChartPanel } from "./chart-panel.js";

const NEAR = { mouse: 24, pen: 24, touch: 44 }; // px
const MOVED = 8; // px; a press that moved further was a drag

const element = (name, className, more = {}) => Object.assign(document.createElement(name), { className }, more);
const linkOf = (custom) => [[custom].flat()[0]].find((link) => typeof link === "string" && link.startsWith("/"));

export class ChartCursor {
  points = [];
  at = null; // the point that is selected

  constructor(chart, words) {
    this.chart = chart;
    this.ring = element("span", "chart-ring", { hidden: true });
    this.line = element("span", "chart-line", { hidden: true });
    chart.append(this.line, this.ring);
    this.panel = new ChartPanel(chart, words, this);
    chart.plot.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    chart.addEventListener("keydown", (event) => this.key(event));
    this.onShared = ({ detail }) => detail.from !== this && detail.axis === this.axisName && this.mark(detail.x);
  }

  connect() {
    document.addEventListener("chartcursor", this.onShared);
  }

  disconnect() {
    document.removeEventListener("chartcursor", this.onShared);
  }

  get axisName() {
    return `${this.chart.axis?.type} ${this.chart.axis?.title?.text}`;
  }

  redraw() {
    this.points = this.chart.plot.data.flatMap((trace, curve) => {
      const axis = this.chart.axes[`yaxis${(trace.yaxis ?? "y").slice(1)}`];
      return (trace.customdata ?? []).flatMap((custom, number) => {
        const link = linkOf(custom);
        if (!link || !axis || trace.x?.[number] == null || trace.y?.[number] == null) return [];
        return [{ link, curve, number, kind: trace.meta ?? curve, x: this.chart.axis.r2l(trace.x[number]), y: axis.r2l(trace.y[number]), axis }];
      });
    }).sort((one, other) => one.x - other.x);
    if (this.at) {
      const { link, kind } = this.at;
      const again = this.points.find((point) => point.link === link && point.kind === kind);
      if (again) this.at = again;
      this.panel.refresh();
    }
    this.place();
  }

  pixels(point) {
    const { axis } = this.chart;
    return [axis._offset + axis.l2p(point.x), point.axis._offset + point.axis.l2p(point.y)];
  }

  seen(x) {
    const [low, high] = this.chart.axis.range.map((end) => this.chart.axis.r2l(end));
    return x >= low && x <= high;
  }

  place() {
    const shown = this.at !== null && this.points.includes(this.at) && this.seen(this.at.x);
    this.ring.hidden = !shown;
    if (shown) {
      const [left, top] = this.pixels(this.at);
      Object.assign(this.ring.style, { left: `${left}px`, top: `${top}px` });
    }
    this.mark(this.marked);
  }

  // A line where this chart or another one is looked at; null takes it away.
  mark(x) {
    this.marked = x;
    const shown = x != null && this.chart.axis && this.seen(x);
    this.line.hidden = !shown;
    if (!shown) return;
    const { axis } = this.chart;
    const { t, b } = this.chart.plot._fullLayout._size;
    Object.assign(this.line.style, { left: `${axis._offset + axis.l2p(x)}px`, top: `${t}px`, height: `${this.chart.plot.clientHeight - t - b}px` });
  }

  tell(x) {
    this.mark(x);
    document.dispatchEvent(new CustomEvent("chartcursor", { detail: { x, axis: this.axisName, from: this } }));
  }

  press(down) {
    if (!this.chart.axis || down.button !== 0) return;
    let several = false;
    const more = (event) => { several ||= event.pointerId !== down.pointerId; };
    const up = (event) => {
      if (event.pointerId !== down.pointerId) return;
      for (const kind of ["pointerup", "pointercancel"]) window.removeEventListener(kind, up, true);
      window.removeEventListener("pointerdown", more, true);
      const moved = Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
      if (event.type === "pointerup" && moved < MOVED && !several) this.pick(event);
    };
    for (const kind of ["pointerup", "pointercancel"]) window.addEventListener(kind, up, true);
    window.addEventListener("pointerdown", more, true);
  }

  pick(event) {
    const box = this.chart.plot.getBoundingClientRect();
    let nearest = null;
    let distance = NEAR[event.pointerType] ?? NEAR.mouse;
    for (const point of this.points) {
      if (!this.seen(point.x)) continue;
      const [x, y] = this.pixels(point);
      const away = Math.hypot(event.clientX - box.left - x, event.clientY - box.top - y);
      if (away <= distance) [nearest, distance] = [point, away];
    }
    if (nearest) this.select(nearest);
  }

  key(event) {
    if (event.target !== this.chart || event.shiftKey || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") {
      if (this.at) this.close();
      else if (this.chart.view.shown) this.chart.view.show(null);
      else return;
    } else if (event.key === "ArrowLeft") this.step(-1);
    else if (event.key === "ArrowRight") this.step(1);
    else if (event.key === "Enter" && this.at) location.assign(this.at.link);
    else return;
    event.preventDefault();
  }

  // The neighbour of its own kind; without one selected the last that is shown, among those of which there are most.
  step(by) {
    if (!this.points.length) return;
    const kinds = Object.groupBy(this.points, (point) => point.kind);
    if (!this.at) {
      const most = Object.values(kinds).reduce((one, other) => (other.length > one.length ? other : one));
      return this.select(most.findLast((point) => this.seen(point.x)) ?? most.at(-1));
    }
    const same = kinds[this.at.kind] ?? [];
    const next = same[same.indexOf(this.at) + by];
    if (same.includes(this.at) && next) this.select(next);
  }

  select(point) {
    this.at = point;
    if (!this.seen(point.x)) {
      const [low, high] = this.chart.view.range;
      this.chart.view.show([point.x - (high - low) / 2, point.x + (high - low) / 2]);
    }
    this.tell(point.x);
    this.panel.show(point.link, point);
    this.place();
  }

  close() {
    this.at = null;
    this.panel.close();
    this.tell(null);
    this.place();
  }

  // The reading beside the one of the panel, which may lie beyond what the chart shows.
  go(link) {
    const point = this.points.find((each) => each.link === link && each.kind === this.at?.kind);
    if (point) this.select(point);
    else this.panel.show(link);
  }
}
