// <plotly-chart src="URL of figure JSON" on="reading:shaft-d40 alarm" label="what it shows, in words"></plotly-chart>
// A chart. Its size comes from CSS (class "zones" is the tall one).
//
//   src    answers {"data": […], "layout": {…}}; asked with ?theme=light|dark&width=pixels, and again when the theme
//          or the width changes
//   on     live events (see live.js) after which it is fetched again, at most once a second; what part is shown is kept
//   label  for those who cannot see it; what the chart shows must also stand in a list on the page
//   name   of the part that is shown, in the address (chart-view.js); "zoom" if left out
//   finer  src takes first and through: of a thinned history the readings that are shown are fetched by themselves
//
// Its x axis is zoomed and moved (chart-gestures.js, chart-strip.js), unless the figure says fixedrange, dragmode false, ties
// its axes together or names categories. A point with a link is selected by a click (chart-cursor.js).
// plotly.js is loaded when the first chart comes near the window. If fetching fails, the chart stays and says in words that
// it is old, and how old.

import { ChartCursor } from "./chart-cursor.js";
import { gestures } from "./chart-gestures.js";
import { ChartStrip } from "./chart-strip.js";
import { ChartView } from "./chart-view.js";
import { coalesced } from "./coalesce.js";
import { courseOf, extentOf, isMovable, isThinned, wallClock } from "./figure.js";
import { subscribe } from "./live.js";
import { loadPlotly } from "./plotly-library.js";
import { theme } from "./theme-switch.js";
import { age } from "./times.js";

const CONFIG = { displayModeBar: false, displaylogo: false, responsive: true, scrollZoom: false };
const LONG = 50; // points; below fewer there is no strip until a part of them is shown
const SETTLED = 250; // ms after the last change of the view finer data is fetched
const HINTED = "inband-chart-hint";

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
    this.size = new ResizeObserver(() => this.drawn && Math.abs(this.clientWidth - this.width) > 40 && this.refresh());
    this.size.observe(this);
    this.refresh();
  }

  disconnectedCallback() {
    this.stop?.();
    this.size?.disconnect();
    this.view.disconnect();
    this.cursor.disconnect();
    document.removeEventListener("themechange", this.onTheme);
    clearInterval(this.clock);
    if (this.drawn) window.Plotly.purge(this.plot);
    this.drawn = false;
  }

  attributeChangedCallback() {
    this.refresh?.();
  }

  build() {
    const label = this.getAttribute("label") ?? "";
    this.words = document.querySelector('meta[name="plotly"]').dataset;
    this.plot = this.appendChild(Object.assign(document.createElement("div"), { className: "plot" }));
    this.plot.setAttribute("role", "img");
    this.plot.setAttribute("aria-label", label);
    this.setAttribute("role", "group");
    this.setAttribute("aria-label", this.words.keys);
    this.view = new ChartView(this.getAttribute("name") ?? "zoom", () => this.moved());
    this.strip = new ChartStrip(this, this.words);
    this.cursor = new ChartCursor(this, this.words);
    gestures(this);
  }

  get axes() {
    return this.plot._fullLayout;
  }

  get axis() {
    return this.drawn ? this.axes.xaxis : null;
  }

  async load() {
    try {
      const width = this.clientWidth; // 0 before the page is laid out
      const [Plotly, whole] = await Promise.all([loadPlotly(), this.ask(width)]);
      const extent = isMovable(whole) ? extentOf(whole) : null;
      this.movable = extent !== null;
      if (this.movable) this.view.grow(extent.whole, extent);
      const finer = this.movable && this.view.shown && this.hasAttribute("finer") && isThinned(whole);
      const figure = finer ? await this.ask(width, this.view.shown) : whole;
      await document.fonts.ready; // letters are measured when drawn
      if (!this.isConnected) return;
      await Plotly.react(this.plot, figure.data, this.layoutOf(figure), { ...CONFIG, doubleClick: !this.movable && "reset" });
      if (!this.drawn) this.listen();
      this.drawn = true;
      this.finer = this.hasAttribute("finer") && isThinned(whole);
      this.width = width;
      this.fetched = Date.now();
      this.offer(whole);
      this.settle();
      if (Math.abs(this.clientWidth - width) > 40) this.refresh(); // laid out while it was on its way
    } catch (error) {
      this.complain(error);
      setTimeout(() => this.isConnected && this.refresh(), 5_000);
    }
  }

  // The figure; of a part of it, with half as much on either side.
  async ask(width, part = null) {
    const url = new URL(this.getAttribute("src"), location.href);
    url.searchParams.set("theme", theme());
    url.searchParams.set("width", Math.max(200, Math.round(width)));
    if (part) {
      for (const name of ["last", "from", "to"]) url.searchParams.delete(name);
      const [low, high] = part;
      url.searchParams.set("first", Math.max(1, Math.floor(low - (high - low) / 2)));
      url.searchParams.set("through", Math.max(1, Math.ceil(high + (high - low) / 2)));
    }
    const answer = await fetch(url, { headers: { Accept: "application/json" }, signal: AbortSignal.timeout(60_000) });
    if (!answer.ok) throw new Error(`${answer.status}`);
    return wallClock(await answer.json());
  }

  layoutOf({ layout }) {
    const made = { ...layout, ...(matchMedia("(pointer: coarse)").matches && { dragmode: false }) };
    if (!this.movable) return made;
    for (const name of Object.keys(made).filter((each) => each.startsWith("yaxis"))) made[name] = { ...made[name], fixedrange: true };
    return { ...made, uirevision: false, xaxis: { ...layout.xaxis, autorange: false, range: this.ends() } };
  }

  // What is shown, as Plotly writes it (and writes into it).
  ends() {
    return this.view.range.map((end) => (this.view.dates ? new Date(end).toISOString().slice(0, -1) : end));
  }

  listen() {
    this.plot.on("plotly_relayout", (event) => {
      if (!this.movable || !("xaxis.range[0]" in event)) return;
      this.view.show([event["xaxis.range[0]"], event["xaxis.range[1]"]].map((end) => this.axis.r2l(end)));
    });
    this.plot.on("plotly_doubleclick", () => this.movable && this.view.shown && this.view.show(null));
    for (const happening of ["plotly_afterplot", "plotly_relayouting"]) this.plot.on(happening, () => this.cursor.place());
    this.plot.on("plotly_hover", ({ points }) => points[0]?.x != null && this.cursor.tell(this.axis.r2l(points[0].x)));
    this.plot.on("plotly_unhover", () => this.cursor.tell(this.cursor.at?.x ?? null));
  }

  // Another part is to be shown.
  moved() {
    if (!this.drawn || !this.movable) return;
    this.strip.update();
    this.strip.root.hidden &&= !this.view.shown;
    this.classList.toggle("with-strip", !this.strip.root.hidden);
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
    this.strip.root.hidden = !this.movable || (course.length < LONG && !this.view.shown);
    this.classList.toggle("with-strip", !this.strip.root.hidden);
    if (this.movable) {
      this.strip.draw(course);
      this.strip.update();
    }
    this.cursor.redraw();
    if (this.movable || this.cursor.points.length) this.tabIndex = 0;
  }

  // Once in a browser: a wheel that scrolls the page over a chart could zoom it.
  hint() {
    if (this.hinted || localStorage.getItem(HINTED)) return;
    this.hinted = true;
    localStorage.setItem(HINTED, "yes");
    const hint = this.appendChild(Object.assign(document.createElement("div"), { className: "chart-hint", textContent: this.words.hint }));
    setTimeout(() => hint.remove(), 4_000);
  }

  settle() {
    clearInterval(this.clock);
    this.trouble?.remove();
    this.trouble = null;
    this.dispatchEvent(new CustomEvent("drawn", { bubbles: true }));
  }

  complain(error) {
    this.trouble ??= this.appendChild(Object.assign(document.createElement("div"), { className: "trouble" }));
    this.trouble.setAttribute("role", "status");
    const say = () => {
      const old = this.fetched ? this.words.old.replace("{age}", age((Date.now() - this.fetched) / 1000)) : "";
      this.trouble.textContent = `▲ ${this.words.trouble} (${error.message}) ${old}`;
    };
    clearInterval(this.clock);
    this.clock = setInterval(say, 1_000);
    say();
  }
}

customElements.define("plotly-chart", PlotlyChart);
