// Charts on paper, which is narrower than a screen: they are drawn for its width, so that their letters can be read.

const PAPER = 860; // px

/** A drawing grows and shrinks with its frame, as the page's print sheet says. */
export function scalable(plot) {
  const boxes = () => {
    for (const svg of plot.querySelectorAll(".main-svg"))
      svg.setAttribute("viewBox", `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
  };
  plot.on("plotly_afterplot", boxes);
  boxes();
}

const charts = () => [...document.querySelectorAll("plotly-chart")].filter((chart) => chart.drawn);
window.addEventListener("beforeprint", () => {
  for (const { plot } of charts()) if (plot.clientWidth > PAPER) window.Plotly.relayout(plot, { width: PAPER, height: plot.clientHeight });
});
window.addEventListener("afterprint", () => {
  for (const { plot } of charts()) window.Plotly.relayout(plot, { width: null, height: null, autosize: true });
});
