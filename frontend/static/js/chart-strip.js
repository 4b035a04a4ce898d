// ChartStrip: the row below a plotly-chart with the buttons that move it, and a small picture of all there is with the part
// that is shown as a window: drag it, or one of its ends; a touch beside it brings it there.
//
//   new ChartStrip(chart, words)   chart has: view (chart-view.js), cursor; words: of the buttons
//   draw(values)                   [[x, low, high], …] of everything, ascending
//   show(is)                       it is there or not, and shows the view as it is now

import { zoomIn, zoomOut } from "./chart-gestures.js";

const COLUMNS = 240;
const HEIGHT = 40;
const HANDLE = 22; // px on either side of an end that take hold of it

const element = (name, className, more = {}) => Object.assign(document.createElement(name), { className }, more);

export class ChartStrip {
  constructor(chart, words) {
    this.chart = chart;
    this.view = chart.view;
    this.root = element("div", "chart-strip");
    this.bar = element("div", "range-bar");
    this.bar.setAttribute("aria-hidden", "true"); // the buttons and the keys do the same
    this.window = element("div", "window");
    this.picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.picture.setAttribute("viewBox", `0 0 ${COLUMNS} ${HEIGHT}`);
    this.picture.setAttribute("preserveAspectRatio", "none");
    this.bar.append(this.picture, this.window);
    const button = (text, label, act) => {
      const made = element("button", "button", { type: "button", textContent: text });
      if (label) made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      return made;
    };
    this.reset = button(words.whole, null, () => this.view.show(null));
    this.follow = button(words.follow, null, () => this.view.follow(!this.view.follows));
    this.follow.title = words.followHelp;
    this.live = chart.hasAttribute("on");
    this.pan = button(words.pan, null, () => {
      this.pans = !this.pans;
      this.pan.setAttribute("aria-pressed", this.pans);
      if (chart.drawn) window.Plotly.relayout(chart.plot, { dragmode: this.dragmode(this.usual) });
    });
    this.pan.title = words.panHelp;
    this.pan.setAttribute("aria-pressed", "false");
    if (!matchMedia("(pointer: coarse)").matches) this.root.append(this.pan);
    this.root.append(
      button("−", words.out, () => zoomOut(chart)), button("+", words.in, () => zoomIn(chart)), this.bar, this.follow, this.reset,
    );
    this.bar.addEventListener("pointerdown", (event) => this.grab(event));
  }

  // What dragging by the mouse does, usually as the figure says; fingers pan by two.
  dragmode(usual = "zoom") {
    this.usual = usual;
    if (matchMedia("(pointer: coarse)").matches) return false;
    return this.pans && usual ? "pan" : usual;
  }

  get isShown() {
    return this.root.isConnected;
  }

  grab(event) {
    event.preventDefault();
    const box = this.bar.getBoundingClientRect();
    const [first, last] = this.view.whole;
    const at = (x) => first + ((x - box.left) / box.width) * (last - first);
    const handle = (HANDLE / box.width) * (last - first);
    let [low, high] = this.view.range;
    const from = at(event.clientX);
    const near = Math.min(handle, (high - low) / 4); // the middle of a narrow window still takes hold of all of it
    const end = Math.abs(from - low) < near || (from < low && low - from < handle) ? 0
      : Math.abs(from - high) < near || (from > high && from - high < handle) ? 1 : null;
    if (end === null && (from < low || from > high)) [low, high] = [from - (high - low) / 2, from + (high - low) / 2];
    const drag = (moved) => {
      const by = at(moved.clientX) - from;
      const range = end === null ? [low + by, high + by] : end ? [low, Math.max(high + by, low)] : [Math.min(low + by, high), high];
      this.view.show(range, { write: false });
    };
    const stop = () => {
      this.bar.removeEventListener("pointermove", drag);
      this.view.write();
    };
    this.bar.setPointerCapture(event.pointerId);
    this.bar.addEventListener("pointermove", drag);
    this.bar.addEventListener("lostpointercapture", stop, { once: true });
    drag(event);
  }

  draw(values) {
    const [first, last] = this.view.whole;
    const columns = [];
    for (const [x, low, high] of values) {
      const at = Math.floor(((x - first) / (last - first)) * COLUMNS);
      const column = (columns[at] ??= [Infinity, -Infinity]);
      columns[at] = [Math.min(column[0], low), Math.max(column[1], high)];
    }
    const filled = columns.filter(Boolean);
    const [lowest, highest] = [Math.min(...filled.map((c) => c[0])), Math.max(...filled.map((c) => c[1]))];
    const y = (value) => (HEIGHT - 4 - ((value - lowest) / (highest - lowest || 1)) * (HEIGHT - 8)).toFixed(1);
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", columns.map((c, at) => `M${at + 0.5} ${y(c[0])}V${(y(c[1]) - 1.5).toFixed(1)}`).join(""));
    this.picture.replaceChildren(path);
  }

  show(is) {
    const { view, chart } = this;
    chart.classList.toggle("with-strip", is);
    if (!is) return this.root.remove();
    if (!this.isShown) chart.append(this.root);
    const [first, last] = view.whole;
    const [low, high] = view.range;
    const percent = (value) => `${((value - first) / (last - first)) * 100}%`;
    Object.assign(this.window.style, { left: percent(low), right: `calc(100% - ${percent(high)})` });
    this.reset.disabled = !view.shown;
    if (view.shown && this.live) this.bar.after(this.follow);
    else this.follow.remove();
    this.follow.setAttribute("aria-pressed", view.follows);
  }
}
