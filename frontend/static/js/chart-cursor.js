// ChartCursor: the point of a plotly-chart that is selected, with a ring about it and a panel beside the chart.
//
// Points are those whose customdata is a link (or has one as its first item). A click, a tap, or ← → selects one; the panel
// (chart-panel.js) says what it is, and only its link opens the page. Charts of one page whose x axes say the same thing share
// a line where one of them is looked at.
//
//   new ChartCursor(chart, words)   chart has: plot (Plotly's element), axis, view, touch
//   redraw()                        the chart has new content     place()   … or another part of it is shown

import { ChartPanel } from "./chart-panel.js";
import { nearest, pixels, pointsOf, pressed } from "./chart-points.js";
import { margins, place, valueOn } from "./plotly-inside.js";

const element = (name, className, more = {}) => Object.assign(document.createElement(name), { className }, more);

export class ChartCursor {
  points = [];
  at = null; // the point that is selected

  constructor(chart, words) {
    this.chart = chart;
    this.ring = element("span", "chart-ring", { hidden: true });
    this.line = element("span", "chart-line", { hidden: true });
    chart.append(this.line, this.ring);
    this.panel = new ChartPanel(chart, words, this);
    pressed(chart.plot, (event) => {
      const point = nearest(chart, this.points.filter(({ x }) => this.seen(x)), event);
      if (point) this.select(point);
    });
    chart.addEventListener("keydown", (event) => this.key(event));
    this.onShared = ({ detail }) => detail.from !== this && detail.axis === this.axisName && this.mark(detail.x);
  }

  connect() {
    document.addEventListener("chartcursor", this.onShared);
  }

  disconnect() {
    document.removeEventListener("chartcursor", this.onShared);
  }

  /** Once Plotly has drawn: follow its view and what the mouse is over. */
  listen() {
    const { plot } = this.chart;
    for (const happening of ["plotly_afterplot", "plotly_relayouting"]) plot.on(happening, () => this.place());
    plot.on("plotly_hover", ({ points }) => points[0]?.x != null && this.tell(valueOn(this.chart.axis, points[0].x)));
    plot.on("plotly_unhover", () => this.tell(this.at?.x ?? null));
  }

  get axisName() {
    return `${this.chart.axis?.type} ${this.chart.axis?.title?.text}`;
  }

  redraw() {
    this.points = pointsOf(this.chart);
    if (this.at) {
      const { link, kind } = this.at;
      const again = this.points.find((point) => point.link === link && point.kind === kind);
      if (again) this.at = again;
      this.panel.refresh();
    }
    this.place();
  }

  seen(x) {
    const [low, high] = this.chart.axis.range.map((end) => valueOn(this.chart.axis, end));
    return x >= low && x <= high;
  }

  place() {
    const shown = this.at !== null && this.points.includes(this.at) && this.seen(this.at.x);
    this.ring.hidden = !shown;
    if (shown) {
      const [left, top] = pixels(this.chart, this.at);
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
    const { t, b } = margins(this.chart.plot);
    Object.assign(this.line.style, { left: `${place(axis, x)}px`, top: `${t}px`, height: `${this.chart.plot.clientHeight - t - b}px` });
  }

  tell(x) {
    this.mark(x);
    document.dispatchEvent(new CustomEvent("chartcursor", { detail: { x, axis: this.axisName, from: this } }));
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
