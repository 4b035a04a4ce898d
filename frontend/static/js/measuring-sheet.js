// <measuring-sheet><form>…<input data-size data-target="40" data-half="0.008">…</form></measuring-sheet>: typing sizes one after the other.
//
//   Enter        the next field; in the last one the sheet is sent. A gauge or a scanner that types ends with Enter, too.
//   output[for]  beside a size: how far off the target it is while one types
//   .number-keys digits to touch, shown where a finger points; the screen's own keyboard stays away from sizes then
//
// What is not a number stays where it is: a scanned part does not become a size. Sent once: the button sleeps until the answer is there.

const MINUS = "\u2212";

/** The size in mm, NaN for what is none, null for nothing. */
function sizeOf(text) {
  const plain = text.trim().replace(/[\u2212\u2010-\u2013]/g, "-").replace(",", ".");
  if (!plain) return null;
  return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain) ? Number(plain) : NaN;
}

class MeasuringSheet extends HTMLElement {
  connectedCallback() {
    this.form = this.querySelector("form");
    this.pad = this.querySelector(".number-keys");
    this.form.addEventListener("keydown", (event) => this.key(event));
    this.form.addEventListener("input", (event) => this.typed(event.target));
    this.form.addEventListener("focusin", (event) => this.chosen(event.target));
    this.form.addEventListener("submit", () => this.sent());
    addEventListener("pageshow", () => this.wake());
    for (const input of this.sizes) this.shown(input);
    if (matchMedia("(pointer: coarse)").matches) this.showPad();
    const wrong = this.querySelector("[aria-invalid]");
    wrong?.focus();
    if (wrong) this.chosen(wrong);
  }

  get sizes() {
    return [...this.form.querySelectorAll("input[data-size]")];
  }

  get fields() {
    const all = [...this.form.querySelectorAll("input:not([type=hidden], [type=radio], [type=checkbox])")];
    return all.filter((input) => !input.closest("details:not([open])"));
  }

  showPad() {
    this.pad.hidden = false;
    for (const input of this.sizes) input.inputMode = "none";
    this.pad.addEventListener("pointerdown", (event) => event.preventDefault()); // the field keeps the cursor
    this.pad.addEventListener("click", (event) => {
      const button = event.target.closest("button");
      const input = this.active ?? this.sizes[0];
      if (!button || !input) return;
      input.focus({ preventScroll: true });
      if (button.hasAttribute("data-next")) return void this.next(input);
      const from = input.selectionStart ?? input.value.length, to = input.selectionEnd ?? from;
      if (button.hasAttribute("data-erases")) input.setRangeText("", from === to ? Math.max(0, from - 1) : from, to, "end");
      else input.setRangeText(button.dataset.types, from, to, "end");
      this.typed(input);
    });
  }

  chosen(target) {
    if (!target.matches?.("input[data-size]")) return;
    this.active = target;
    target.select();
    if (!this.pad.hidden) target.closest(".sheet-line").scrollIntoView({ block: "nearest" }); // above the digits
    this.pad.querySelector(".number-keys-of").textContent = target.labels[0]?.textContent.trim().replace(/\s+/g, " ") ?? "";
  }

  key(event) {
    if (event.key !== "Enter" || event.isComposing || !this.fields.includes(event.target)) return;
    event.preventDefault();
    this.next(event.target);
  }

  next(input) {
    if (input.matches("[data-size]") && Number.isNaN(sizeOf(input.value))) {
      input.setAttribute("aria-invalid", "true");
      return void input.select();
    }
    const fields = this.fields;
    const following = fields[fields.indexOf(input) + 1];
    if (following && following.name !== "other_name") return void following.focus();
    this.form.requestSubmit(this.form.querySelector(".sheet-actions button"));
  }

  /** What was said about a size is about what was sent, not about what is typed now. */
  typed(input) {
    if (!input.matches("input[data-size]")) return;
    if (!Number.isNaN(sizeOf(input.value))) input.removeAttribute("aria-invalid");
    this.shown(input);
  }

  shown(input) {
    const output = [...this.form.querySelectorAll("output")].find((each) => each.htmlFor.contains(input.id));
    const size = sizeOf(input.value);
    const off = size === null || Number.isNaN(size) ? null : Math.round((size - input.dataset.target) * 1e7) / 1e4; // µm
    output.toggleAttribute("data-out", off !== null && Math.abs(off) > input.dataset.half * 1000 + 1e-6);
    const far = off !== null && Math.abs(off) >= 1000;
    output.textContent = off === null ? "" : `${off < 0 ? MINUS : "+"}${Math.abs(far ? off / 1000 : off).toFixed(far ? 3 : input.dataset.decimals)}\u00a0${far ? "mm" : "µm"}`;
  }

  sent() {
    setTimeout(() => { for (const button of this.form.querySelectorAll(".sheet-actions button")) button.disabled = true; });
  }

  wake() {
    for (const button of this.form.querySelectorAll(".sheet-actions button")) button.disabled = false;
  }
}
customElements.define("measuring-sheet", MeasuringSheet);
