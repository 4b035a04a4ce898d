// Words of a chart that are details (named so in the figure) are given up where they would lie over the words beside them: in a low chart.

import { axisOf, notes, pixelOn } from "./plotly-inside.js";

const LEAST = 14; // px from line to line

export function withoutCrowded(plot) {
  const giveUp = () => {
    const drawn = notes(plot);
    const at = ({ yref, y }) => { // not of the paper, which has no axis
      const axis = axisOf(plot, yref);
      return axis && pixelOn(axis, y);
    };
    for (const [index, note] of drawn.entries()) {
      if (note.name !== "detail") continue;
      const beside = drawn.filter((each) => each !== note && each.yref === note.yref && each.x === note.x);
      const crowded = beside.some((each) => Math.abs(at(each) - at(note)) < LEAST);
      plot.querySelector(`.annotation[data-index="${index}"]`)?.style.setProperty("display", crowded ? "none" : "");
    }
  };
  plot.on("plotly_afterplot", giveUp);
  giveUp();
}
