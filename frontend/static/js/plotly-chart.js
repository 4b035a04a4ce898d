// <plotly-chart src="URL of figure JSON" on="reading:shaft-d40 alarm" label="what it shows, in words"></plotly-chart>
// A chart. Its size comes from CSS (class "zones" is the tall one).
//
//   src    answers {"data": […], "layout": {…}}; asked with ?theme=light|dark&width=pixels, and again when the theme
//          or the width changes
//   on     live events (see live.js) after which it is fetched again, at most once a second; zoom is kept
//   label  for those who cannot see it; what the chart shows must also stand in a list on the page
//
// A point whose customdata is a URL (or has one as its first item) opens it when clicked. plotly.js is loaded when the
// first chart needs it. If fetching fails, the chart stays and says in words that it is old, and how old.
//
// Our policy forbids injected style sheets: plotly.css stands in for plotly's own, and empty elements with the ids of
// the others tell plotly that they are there already (see app/web/assets.py). It forbids style attributes too; plotly
// sets them for <b> and the like, so SVG elements take them as what they mean: the same declarations, set by script.

import { coalesced } from "./coalesce.js";
import { subscribe } from "./live.js";
import { theme } from "./theme-switch.js";
import { age } from "./times.js";

const CONFIG = { displayModeBar: false, displaylogo: false, responsive: true, doubleClick: "reset", scrollZoom: false };
let loading = null;

function loadPlotly() {
  loading ??= new Promise((resolve, reject) => {
    const where = document.querySelector('meta[name="plotly"]');
    for (const id of where.dataset.injected.split(" ")) document.head.append(Object.assign(document.createElement("meta"), { id }));
    document.head.append(Object.assign(document.createElement("link"), {
      id: "plotly.js-style-global", className: "no-inline-styles", rel: "stylesheet", href: where.dataset.styles,
    }));
    const script = Object.assign(document.createElement("script"), { src: where.content });
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => {
      loading = null;
      script.remove();
      reject(new Error("plotly.min.js"));
    };
    document.head.append(script);
  });
  return loading;
}

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

SVGElement.prototype.setAttribute = function setAttribute(name, value) {
  if (name === "style") this.style.cssText = value;
  else Element.prototype.setAttribute.call(this, name, value);
};

class PlotlyChart extends HTMLElement {
  static observedAttributes = ["src"];

  connectedCallback() {
    this.plot ??= this.appendChild(Object.assign(document.createElement("div"), { className: "plot" }));
    this.plot.setAttribute("role", "img");
    this.plot.setAttribute("aria-label", this.getAttribute("label") ?? "");
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
    document.removeEventListener("themechange", this.onTheme);
    clearInterval(this.clock);
    if (this.drawn) window.Plotly.purge(this.plot);
    this.drawn = false;
  }

  attributeChangedCallback() {
    this.refresh?.();
  }

  async load() {
    try {
      const url = new URL(this.getAttribute("src"), location.href);
      url.searchParams.set("theme", theme());
      const width = this.clientWidth; // 0 before the page is laid out
      url.searchParams.set("width", Math.max(200, Math.round(width)));
      const [Plotly, answer] = await Promise.all([loadPlotly(), fetch(url, { headers: { Accept: "application/json" }, signal: AbortSignal.timeout(60_000) })]);
      if (!answer.ok) throw new Error(`${answer.status}`);
      const figure = wallClock(await answer.json());
      await document.fonts.ready; // letters are measured when drawn
      if (!this.isConnected) return;
      const touch = matchMedia("(pointer: coarse)").matches;
      await Plotly.react(this.plot, figure.data, { ...figure.layout, ...(touch && { dragmode: false }) }, CONFIG);
      if (!this.drawn) this.plot.on("plotly_click", (event) => this.open(event.points[0]));
      this.drawn = true;
      this.width = width;
      this.fetched = Date.now();
      this.settle();
      if (Math.abs(this.clientWidth - width) > 40) this.refresh(); // laid out while it was on its way
    } catch (error) {
      this.complain(error);
      setTimeout(() => this.isConnected && this.refresh(), 5_000);
    }
  }

  open(point) {
    const link = [point?.customdata].flat()[0];
    if (typeof link === "string" && link.startsWith("/")) location.assign(link);
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
    const words = document.querySelector('meta[name="plotly"]').dataset;
    const say = () => {
      const old = this.fetched ? words.old.replace("{age}", age((Date.now() - this.fetched) / 1000)) : "";
      this.trouble.textContent = `▲ ${words.trouble} (${error.message}) ${old}`;
    };
    clearInterval(this.clock);
    this.clock = setInterval(say, 1_000);
    say();
  }
}

customElements.define("plotly-chart", PlotlyChart);
