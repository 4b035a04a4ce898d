// ChartView: the part of a chart's x axis that is shown.
//
//   name       kept in the address under it: ?name=120..180; last..60 moves along with new readings. Charts of one name
//              (an axis that they share) show the same part. Dates stand as the wall clock of the plant
//   changed()  is called when it has changed
//
// One gesture is one entry of the browser's history: Back undoes it. Values are numbers; dates are milliseconds.

const GESTURE = 700; // ms; what follows sooner belongs to the same gesture
const MARGIN = 0.002; // of the whole: nearer to its end is at its end

const number = (text) => (/[-:]\d\d/.test(text) ? Date.parse(`${text}Z`) : text === "" ? NaN : Number(text));

export class ChartView {
  whole = null; // [low, high] of everything there is
  shown = null; // [low, high] of what is chosen; null is the whole
  follows = false;
  dates = false;
  least = 0; // nothing narrower is shown
  written = -Infinity;

  constructor(name, changed) {
    this.name = name;
    this.changed = changed;
    this.onPop = () => this.read();
    this.onShared = ({ detail }) => detail.from !== this && detail.name === this.name && this.read();
  }

  connect() {
    window.addEventListener("popstate", this.onPop);
    document.addEventListener("chartview", this.onShared);
  }

  disconnect() {
    window.removeEventListener("popstate", this.onPop);
    document.removeEventListener("chartview", this.onShared);
  }

  get range() {
    return this.shown ?? this.whole;
  }

  // New readings came, or others were chosen: a view that follows keeps its span.
  grow(whole, { dates, least }) {
    const first = !this.whole;
    Object.assign(this, { whole, dates, least });
    if (first) this.take();
    else if (this.follows) this.shown = this.within(this.shown.map((end) => end + whole[1] - this.shown[1]));
  }

  within([low, high]) {
    const [first, last] = this.whole;
    const span = Math.max(high - low, Math.min(this.least, last - first));
    if (!(span < (last - first) * (1 - MARGIN))) return null;
    const begin = Math.min(Math.max((low + high - span) / 2, first), last - span);
    return [begin, begin + span];
  }

  // The address says what is shown.
  take() {
    const [from, to] = (new URLSearchParams(location.search).get(this.name) ?? "").split("..");
    this.follows = from === "last" && Number(to) > 0;
    const last = this.whole[1];
    const ends = this.follows ? [last - Number(to), last] : [number(from ?? ""), number(to ?? "")];
    this.shown = ends[0] < ends[1] ? this.within(ends) : null;
    this.follows &&= this.shown !== null;
  }

  read() {
    if (!this.whole) return;
    this.take();
    this.changed();
  }

  show(range, { write = true } = {}) {
    this.shown = range && this.within(range);
    this.follows &&= this.shown !== null && this.shown[1] >= this.whole[1] - (this.whole[1] - this.whole[0]) * MARGIN;
    if (write) this.write();
    this.changed();
  }

  follow(follows) {
    if (!this.shown) return;
    const [low, high] = this.shown;
    this.follows = follows;
    if (follows) this.shown = this.within([this.whole[1] - (high - low), this.whole[1]]);
    this.write();
    this.changed();
  }

  // What lies at the share `at` of the width stays where it is.
  zoom(factor, at = 0.5) {
    const [low, high] = this.range;
    const [centre, span] = [low + (high - low) * at, (high - low) * factor];
    this.show(this.follows ? [high - span, high] : [centre - span * at, centre + span * (1 - at)]);
  }

  pan(share) {
    const [low, high] = this.range;
    this.show([low + (high - low) * share, high + (high - low) * share]);
  }

  write() {
    const url = new URL(location.href);
    const [low, high] = this.range;
    const decimals = Math.min(9, Math.max(0, Math.ceil(2 - Math.log10(high - low))));
    const word = (value) => (this.dates ? new Date(value).toISOString().slice(0, 19) : String(Number(value.toFixed(decimals))));
    const value = this.follows ? `last..${Number((high - low).toFixed(decimals))}` : this.shown?.map(word).join("..");
    if (value) url.searchParams.set(this.name, value);
    else url.searchParams.delete(this.name);
    if (url.href === location.href) return;
    const now = performance.now();
    history[now - this.written > GESTURE ? "pushState" : "replaceState"](null, "", url);
    this.written = now;
    document.dispatchEvent(new CustomEvent("chartview", { detail: { name: this.name, from: this } }));
  }
}
