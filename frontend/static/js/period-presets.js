// <period-presets hidden><button data-from="2026-11-23T06:00" data-to="">This shift</button> …</period-presets>
// Usual periods beside the fields from and to of a form: a button fills them in, and empties the number of last readings.
// A period picker (<details class="period-picker">) is closed by Escape and by a click beside it.

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

const opened = () => document.querySelector("details.period-picker[open]");

document.addEventListener("keydown", (event) => {
  const picker = event.key === "Escape" && opened();
  if (!picker) return;
  picker.open = false;
  picker.querySelector("summary").focus();
});
document.addEventListener("pointerdown", ({ target }) => {
  const picker = opened();
  if (picker && !picker.contains(target)) picker.open = false;
});
