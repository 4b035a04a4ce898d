// Words of a chart that are details (named so in the figure) are given up where they would lie over the words beside them: in a low chart.

const LEAST = 12; // px from line to line

export function withoutCrowded(plot) {
  const giveUp = () => {
    const notes = plot._fullLayout.annotations ?? [];
    const at = ({ yref, y }) => plot._fullLayout[yref.replace("y", "yaxis")]?.l2p(y);
    for (const [index, note] of notes.entries()) {
      if (note.name !== "detail") continue;
      const beside = notes.filter((each) => each !== note && each.yref === note.yref && each.x === note.x);
      const crowded = beside.some((each) => Math.abs(at(each) - at(note)) < LEAST);
      plot.querySelector(`.annotation[data-index="${index}"]`)?.style.setProperty("display", crowded ? "none" : "");
    }
  };
  plot.on("plotly_afterplot", giveUp);
  giveUp();
}
