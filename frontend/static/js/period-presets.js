// <period-presets hidden><button data-from="2026-11-23T06:00" data-to="">This shift</button> …</period-presets>
// Usual periods beside the fields from and to of a form: a button fills them in, and empties the number of last readings.

class PeriodPresets extends HTMLElement {
  connectedCallback() {
    this.hidden = false;
    this.addEventListener("click", ({ target }) => {
      const preset = target.closest("[data-from]");
      if (!preset) return;
      const { elements } = this.closest("form");
      elements.from.value = preset.dataset.from;
      elements.to.value = preset.dataset.to;
      if (elements.last) elements.last.value = "";
      elements.from.dispatchEvent(new Event("change", { bubbles: true }));
    });
  }
}

customElements.define("period-presets", PeriodPresets);
