// ChartPanel: what is known of the point that is selected in a plotly-chart.
//
// Of a reading it is the fragment at <link>/panel, whose links rel="prev" and "next" select its neighbours; of anything else
// the words at the point, and its link.
//
//   show(link, point)   point: {curve, number} of Plotly's; left out for a reading that the chart does not show
//   refresh()           the chart has new content
//   close()

const READING = /\/characteristics\/[^/]+\/readings\/\d+$/;

const element = (name, className, more = {}) => Object.assign(document.createElement(name), { className }, more);

export class ChartPanel {
  constructor(chart, words, cursor) {
    Object.assign(this, { chart, words, cursor });
    this.root = element("aside", "chart-panel", { hidden: true });
    this.root.setAttribute("aria-label", words.point);
    this.root.setAttribute("aria-live", "polite");
    this.root.addEventListener("click", (event) => this.press(event));
    chart.append(this.root);
  }

  show(link, point) {
    this.link = link;
    if (this.root.hidden) this.fill([this.opening(link)], null); // until more is known
    this.root.hidden = false;
    this.chart.classList.add("with-panel");
    if (READING.test(link)) this.load(link);
    else this.repeat(link, point);
  }

  refresh() {
    if (READING.test(this.link)) this.load(this.link);
  }

  close() {
    this.link = null;
    this.root.hidden = true;
    this.chart.classList.remove("with-panel");
  }

  async load(link) {
    try {
      const answer = await fetch(`${link}/panel`, { signal: AbortSignal.timeout(30_000) });
      if (!answer.ok) throw new Error(`${answer.status}`);
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      if (this.link === link) this.fill([...document.adoptNode(page.body).childNodes], link);
    } catch {
      if (this.link === link && this.filled !== link) this.fill([this.opening(link)], link); // what it says stays where it is of this reading
    }
  }

  repeat(link, { curve, number }) {
    window.Plotly.Fx.hover(this.chart.plot, [{ curveNumber: curve, pointNumber: number }]);
    const read = () => {
      if (this.link !== link) return;
      const words = [...this.chart.plot.querySelectorAll(".hoverlayer .hovertext text")].map((text) =>
        [...text.querySelectorAll("tspan.line")].map((line) => line.textContent).join("\n") || text.textContent);
      this.fill([element("p", "words", { textContent: words.join("\n") }), this.opening(link)], link);
    };
    setTimeout(read, 80); // Plotly shows it at most so often
  }

  opening(link) {
    return element("a", "button", { href: link, textContent: this.words.open });
  }

  fill(content, link) {
    const focused = this.root.contains(document.activeElement) && document.activeElement.rel;
    const close = element("button", "button plain close", { type: "button", textContent: "×" });
    close.setAttribute("aria-label", this.words.close);
    this.filled = link;
    this.root.replaceChildren(close, ...content);
    if (focused) this.root.querySelector(`[rel="${focused}"]`)?.focus();
  }

  press(event) {
    if (event.target.closest(".close")) {
      this.cursor.close();
      return this.chart.focus({ preventScroll: true });
    }
    const link = event.target.closest('a[rel="prev"], a[rel="next"]');
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    this.cursor.go(link.getAttribute("href"));
  }
}
