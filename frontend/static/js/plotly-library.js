// loadPlotly() -> plotly.js, loaded when it is first asked for and the page has been painted.
//
// Our policy forbids injected style sheets: plotly.css stands in for plotly's own, and empty elements with the ids of
// the others tell plotly that they are there already (see app/web/assets.py). It forbids style attributes too; plotly
// sets them for <b> and the like, so SVG elements take them as what they mean: the same declarations, set by script.

let loading = null;

const painted = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

export function loadPlotly() {
  loading ??= painted().then(() => new Promise((resolve, reject) => {
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
  }));
  return loading;
}

SVGElement.prototype.setAttribute = function setAttribute(name, value) {
  if (name === "style") this.style.cssText = value;
  else Element.prototype.setAttribute.call(this, name, value);
};
