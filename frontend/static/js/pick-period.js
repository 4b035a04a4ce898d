// <pick-period form="id of a form"> <plotly-chart …></plotly-chart> <button data-picks="period|excluded">… </pick-period>
// Choosing a period, and what is left out of it, on a chart.
//
//   form   holds the fields first_sequence, last_sequence and excluded (one run a line: "640-641 reason")
//
// Dragging over the chart fills in the period, or, with the other button pressed, adds a run to what is left out; a click on a
// point adds that point. The form alone does all of it as well: without script, by keyboard and on a touch screen.
// The chart's points carry their sequence as customdata, and its layout says dragmode "select".

class PickPeriod extends HTMLElement {
  connectedCallback() {
    this.addEventListener("drawn", (event) => this.listen(event.target.plot), { once: true });
    const buttons = [...this.querySelectorAll("[data-picks]")];
    for (const button of buttons) {
      button.parentElement.hidden = false;
      button.addEventListener("click", () => buttons.forEach((each) => each.setAttribute("aria-pressed", each === button)));
    }
  }

  get fields() {
    return document.getElementById(this.getAttribute("form")).elements;
  }

  get excludes() {
    return this.querySelector('[data-picks="excluded"]')?.getAttribute("aria-pressed") === "true";
  }

  listen(plot) {
    plot.on("plotly_selected", (event) => {
      if (!event?.range) return;
      const [low, high] = event.range.x;
      this.pick(Math.max(1, Math.ceil(Math.min(low, high))), Math.max(1, Math.floor(Math.max(low, high))));
      this.show(plot);
    });
    plot.on("plotly_click", (event) => {
      const number = event.points[0]?.customdata;
      if (Number.isInteger(number)) this.leaveOut(number, number);
    });
  }

  // Plotly keeps what was selected, and the next drag that begins inside would move it: what is left out lies inside the
  // period. So the selection goes, and a band without a handle shows the period.
  show(plot) {
    const { first_sequence: first, last_sequence: last } = this.fields;
    const shapes = (plot.layout.shapes ?? []).filter((shape) => shape.name !== "picked");
    if (first.value && last.value) {
      const [x0, x1] = [Number(first.value) - 0.5, Number(last.value) + 0.5];
      const fill = { fillcolor: plot.layout.font?.color, opacity: 0.12, line: { width: 0 }, layer: "below" };
      shapes.push({ name: "picked", type: "rect", xref: "x", yref: "paper", x0, x1, y0: 0, y1: 1, ...fill });
    }
    window.Plotly.relayout(plot, { selections: [], shapes });
  }

  pick(first, last) {
    if (first > last) return;
    if (this.excludes) return this.leaveOut(first, last);
    this.fields.first_sequence.value = first;
    this.fields.last_sequence.value = last;
    this.told("first_sequence");
  }

  leaveOut(first, last) {
    const field = this.fields.excluded;
    const run = first === last ? `${first}` : `${first}-${last}`;
    field.value = `${field.value.trimEnd()}${field.value.trim() ? "\n" : ""}${run} `;
    this.told("excluded");
    field.focus({ preventScroll: true }); // the reason is still to be typed
    field.setSelectionRange(field.value.length, field.value.length);
  }

  told(name) {
    this.fields[name].dispatchEvent(new Event("input", { bubbles: true }));
  }
}

customElements.define("pick-period", PickPeriod);
