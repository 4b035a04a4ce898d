// <plotly-chart src="URL of figure JSON" on="reading:shaft-d40 alarm" label="what it shows, in words"></plotly-chart>
// A chart. Its size comes from CSS (class "zones" is the tall one).
//
//   src    answers {"data": […], "layout": {…}}; asked with ?theme=light|dark&width=pixels, again when one of them changes
//   on     live events (see live.js) after which it is fetched again, at most once a second; what part is shown is kept
//   label  for those who cannot see it; what the chart shows must also stand in a list on the page
//   name   of the part that is shown, in the address (chart-view.js); "zoom" if left out
//   finer  src takes first and through: of a thinned history the readings that are shown are fetched by themselves
//
// Its x axis is zoomed and moved (chart-gestures.js, chart-strip.js), unless the figure says fixedrange, dragmode false, ties
// its axes together or names categories. A point with a link is selected by a click (chart-cursor.js).
// plotly.js is loaded when the first chart comes near the window. If fetching fails, the chart stays and says how old it is.

import { ChartCursor } from "./chart-cursor.js";
import { withoutCrowded } from "./chart-details.js";
import { gestures } from "./chart-gestures.js";
import { scalable } from "./chart-paper.js";
import { ChartStrip } from "./chart-strip.js";
import { ChartTrouble } from "./chart-trouble.js";
import { ChartView } from "./chart-view.js";
import { coalesced } from "./coalesce.js";
import { courseOf, extentOf, fetchFigure, isMovable, isThinned, withRange } from "./figure.js";
import { subscribe } from "./live.js";
import { axisOf, boxIsDrawn, heightDrawn, valueOn } from "./plotly-inside.js";
import { loadPlotly } from "./plotly-library.js";

const CONFIG = { displayModeBar: false, displaylogo: false, responsive: true, scrollZoom: false, showTips: false };
const LONG = 50; // points; below fewer there is no strip until a part of them is shown
const SETTLED = 250; // ms after the last change of the view finer data is fetched

class PlotlyChart extends HTMLElement {
  static observedAttributes = ["src"];

  connectedCallback() {
    if (!this.plot) this.build();
    this.view.connect();
    this.cursor.connect();
    this.refresh = coalesced(() => this.load());
    this.onTheme = () => this.refresh();
    document.addEventListener("themechange", this.onTheme);
    this.stop = subscribe(this.getAttribute("on"), () => this.refresh());
    this.size = new ResizeObserver(() => this.drawn && this.fit());
    for (const box of [this, this.plot]) this.size.observe(box);
    this.refresh();
  }

  disconnectedCallback() {
    this.stop?.();
    this.size?.disconnect();
    for (const part of [this.view, this.cursor]) part.disconnect();
    document.removeEventListener("themechange", this.onTheme);
    this.trouble.end();
    if (this.drawn) window.Plotly.purge(this.plot);
    this.drawn = false;
  }

  fit() { // another width is another figure; drawn for another height, as before the strip came, the strip would cover its axis
    if (Math.abs(this.clientWidth - this.width) > 40) this.refresh();
    else if (!this.plot.layout.height && Math.abs(this.plot.clientHeight - heightDrawn(this.plot)) > 2) window.Plotly.Plots.resize(this.plot);
  }

  attributeChangedCallback() {
    this.refresh?.();
  }

  build() {
    this.words = document.querySelector('meta[name="plotly"]').dataset;
    this.plot = this.appendChild(Object.assign(document.createElement("div"), { className: "plot" }));
    this.plot.dataset.waiting = this.words.drawing; // shown while nothing is drawn (charts.css)
    this.plot.setAttribute("role", "img");
    this.plot.setAttribute("aria-label", this.getAttribute("label") ?? "");
    this.setAttribute("role", "group");
    this.setAttribute("aria-label", this.words.keys);
    this.view = new ChartView(this.getAttribute("name") ?? "zoom", () => this.moved());
    this.strip = new ChartStrip(this, this.words);
    this.cursor = new ChartCursor(this, this.words);
    this.trouble = new ChartTrouble(this, this.words);
    gestures(this);
  }

  get axis() { return this.drawn ? axisOf(this.plot, "x") : null; }

  async load() {
    try {
      const width = this.clientWidth; // 0 before the page is laid out
      const src = this.getAttribute("src");
      const [Plotly, whole] = await Promise.all([loadPlotly(), fetchFigure(src, width)]);
      const extent = isMovable(whole) ? extentOf(whole) : null;
      this.movable = extent !== null;
      if (this.movable) this.view.grow(extent.whole, extent);
      this.finer = this.movable && this.hasAttribute("finer") && isThinned(whole);
      const figure = this.finer && this.view.shown ? await fetchFigure(src, width, this.view.shown) : whole;
      await document.fonts.ready; // letters are measured when drawn
      while (boxIsDrawn(this.plot)) await new Promise((resolve) => setTimeout(resolve, 100)); // a box that is being drawn
      if (!this.isConnected) return;
      const layout = this.movable ? withRange(figure.layout, this.ends()) : figure.layout;
      await Plotly.react(this.plot, figure.data, { ...layout, dragmode: this.strip.dragmode(layout.dragmode) }, { ...CONFIG, doubleClick: !this.movable && "reset" });
      if (!this.drawn) this.listen();
      this.drawn = true;
      this.width = width;
      this.offer(whole);
      this.trouble.over();
      this.dispatchEvent(new CustomEvent("drawn", { bubbles: true }));
      if (Math.abs(this.clientWidth - width) > 40) this.refresh(); // laid out while it was on its way
    } catch (error) {
      this.trouble.say(error);
      setTimeout(() => this.isConnected && this.refresh(), 5_000);
    }
  }

  // What is shown, as Plotly writes it (and writes into it).
  ends() {
    return this.view.range.map((end) => (this.view.dates ? new Date(end).toISOString().slice(0, -1) : end));
  }

  listen() {
    this.plot.on("plotly_relayout", (event) => {
      if (!this.movable || !("xaxis.range[0]" in event)) return;
      this.view.show([event["xaxis.range[0]"], event["xaxis.range[1]"]].map((end) => valueOn(this.axis, end)));
    });
    this.plot.on("plotly_doubleclick", () => this.movable && this.view.shown && this.view.show(null));
    scalable(this.plot);
    withoutCrowded(this.plot);
    this.cursor.listen();
  }

  // Another part is to be shown.
  moved() {
    if (!this.drawn || !this.movable) return;
    this.strip.show(this.strip.isShown || this.view.shown !== null);
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (this.drawn) window.Plotly.relayout(this.plot, { "xaxis.range": this.ends() });
    });
    clearTimeout(this.settling);
    if (this.finer) this.settling = setTimeout(() => this.refresh(), SETTLED);
  }

  // What can be done with it.
  offer(whole) {
    const course = this.movable ? courseOf(whole) : [];
    if (this.movable) this.strip.draw(course);
    this.strip.show(this.movable && (course.length >= LONG || this.view.shown !== null));
    this.cursor.redraw();
    if (this.movable || this.cursor.points.length) this.tabIndex = 0;
  }
}

customElements.define("plotly-chart", PlotlyChart);
