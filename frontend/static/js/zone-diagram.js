// <zone-diagram data-sentences='[{"field","text"} × 4]' data-not-a-number="…" data-not-a-size="…">: the zone diagram beside the parameter form.
//
// The server has drawn it; bands are equally tall, so what follows the typing is words alone. With every key it
//   – writes deviation and size at each limit, target and width (L75), and the µm beside each length ([data-um]);
//   – writes a tolerance class typed with the nominal size, 40 h6, as nominal and deviations once the field is left;
//   – proposes the size in a name such as Bore 30 H7, and 0 as the natural limit of Run-out, where nothing is typed yet;
//   – shows what an empty limit of a new characteristic takes (form[data-suggests]);
//   – marks a limit that breaks R33 < R34 ≤ R35/2 ≤ R37 ≤ R36, and says why at the field, in the server's own sentences.
// The server checks the same again when the form is sent; without this script nothing is lost but the immediacy.

import { NameProposal, naturalSide, ofClass, ofTolerance } from "./proposed-limits.js";
import { deviation, millimetres, MINUS, nanometres, plain, size, typed, usable } from "./sizes.js";

const NAMES = ["nominal", "upper_deviation", "lower_deviation", "target", "tolerance_width",
  "zero_range", "averaging_limit", "wear_limit", "confidence_limit"];
const ORDER = ["zero_range", "averaging_limit", "tolerance", "wear_limit", "confidence_limit"];
customElements.define("zone-diagram", class extends HTMLElement {
  connectedCallback() {
    this.form = this.closest("form");
    this.sentences = JSON.parse(this.dataset.sentences);
    this.one_sided = JSON.parse(this.dataset.oneSided); // from a natural limit R35 counts whole
    const proposal = new NameProposal(this.form, (values) => this.fill(values));
    this.typing = (event) => {
      proposal.typedOver(event.target.name);
      this.forget(event.target);
      this.draw();
    };
    this.form.addEventListener("input", this.typing);
    this.leaving = async ({ target: { name, value } }) => {
      if (name === "name") await proposal.of(value);
      if (name !== "nominal") return;
      const numbers = await ofClass(this.form, value);
      if (numbers) this.unknown = "nominal" in numbers ? null : value; // refused in words when the form is sent
      this.fill(numbers);
    };
    this.form.addEventListener("change", this.leaving);
    this.draw();
  }

  fill(values) {
    if (!values) return;
    for (const [name, value] of Object.entries(values)) {
      this.form.elements[name].value = value;
      this.forget(this.form.elements[name]);
    }
    this.draw();
  }

  disconnectedCallback() {
    this.form.removeEventListener("input", this.typing);
    this.form.removeEventListener("change", this.leaving);
  }

  /** What the server said about a field is about what was sent, not about what is typed now. */
  forget(input) {
    const field = input.closest(".field");
    field?.querySelector(".error:not([data-live])")?.remove();
    if (!field?.querySelector(".error")) input.removeAttribute("aria-invalid");
  }

  draw() {
    const values = Object.fromEntries(NAMES.map((name) => [name, typed(this.form.elements[name].value)]));
    let { target, tolerance_width: width } = values;
    const drawing = [values.nominal, values.upper_deviation, values.lower_deviation];
    if (drawing.every(usable)) {
      target = values.nominal + (values.upper_deviation + values.lower_deviation) / 2;
      width = values.upper_deviation - values.lower_deviation;
    }
    const natural = naturalSide(this.form, values); // -1, 0 or 1: the side that does not exist; the target is its limit
    if (natural && drawing.every(usable)) target += (natural * width) / 2;
    const half = natural ? width : width / 2;
    const limits = {
      ...values,
      tolerance: usable(width) ? half : null,
      averaging_limit: values.averaging_limit ?? (usable(width) ? (half * 2) / 3 : null),
    };
    const suggested = "suggests" in this.form.dataset && usable(half) && half > 0 ? ofTolerance(half) : {};
    for (const [name, value] of Object.entries(suggested)) {
      this.form.elements[name].placeholder = plain(value);
      limits[name] = values[name] ?? value;
    }
    this.form.elements.averaging_limit.placeholder = usable(width) && width > 0 ? plain((half * 2) / 3) : "";
    this.write(target, width, limits, natural);
    this.explain(values, limits, natural);
  }

  write(target, width, limits, natural) {
    for (const group of this.querySelectorAll("[data-limit]")) {
      const side = Number(group.dataset.side);
      const limit = side === natural ? null : limits[group.dataset.limit];
      group.querySelector(".deviation").textContent = usable(limit) ? `${side > 0 ? "+" : MINUS}${deviation(limit)}` : "–";
      group.querySelector(".size").textContent = usable(limit) && usable(target) ? size(target + side * limit) : "";
    }
    for (const r of this.querySelectorAll('[data-limit="tolerance"] .r-number')) r.textContent = natural ? "R35" : "R35/2";
    this.querySelector("[data-target]").textContent = usable(target) ? size(target) : "";
    for (const [name, value] of [["target", target], ["width", width]]) {
      const output = this.form.querySelector(`[data-size="${name}"]`);
      output.textContent = usable(value) ? `${size(value)} mm` : "–";
    }
    for (const output of this.form.querySelectorAll("[data-um]")) {
      const value = typed(this.form.elements[output.dataset.um].value);
      const sign = value < 0 ? MINUS : output.dataset.um.endsWith("deviation") ? "+" : "";
      output.textContent = usable(value) ? `${sign}${plain(Math.abs(value) * 1000)}\u00a0µm` : "";
    }
  }

  explain(values, limits, natural) {
    const said = new Map();
    const size = this.form.elements.nominal.value;
    const typing = /[a-z]/i.test(size) && size !== this.unknown; // a class, until the server has looked at it
    const isWrong = (name) => Number.isNaN(values[name]) && !(typing && name === "nominal");
    for (const name of NAMES.filter(isWrong)) said.set(name, name === "nominal" ? this.dataset.notASize : this.dataset.notANumber);
    const wrong = new Set();
    ORDER.slice(1).forEach((outer, index) => {
      const [smaller, larger] = [limits[ORDER[index]], limits[outer]];
      if (!usable(smaller) || !usable(larger)) return;
      const [below, above] = [nanometres(smaller), nanometres(larger)];
      if (index === 0 ? below < above : below <= above) return;
      wrong.add(ORDER[index]).add(outer);
      const { field, text } = (natural ? this.one_sided : this.sentences)[index];
      const sentence = text.replace("{smaller}", millimetres(smaller)).replace("{larger}", millimetres(larger));
      said.set(field, said.has(field) ? `${said.get(field)}. ${sentence}` : sentence);
    });
    for (const group of this.querySelectorAll("[data-limit]")) group.classList.toggle("wrong", wrong.has(group.dataset.limit));
    for (const name of NAMES) this.say(name, said.get(name));
  }

  /** Say at a field what is wrong with it now, or nothing. What the server said stays until the field is typed in. */
  say(name, sentence) {
    const input = this.form.elements[name];
    const field = input.closest(".field");
    let note = field.querySelector(".error[data-live]");
    if (!sentence || field.querySelector(".error:not([data-live])")) {
      if (note) {
        note.remove();
        input.removeAttribute("aria-invalid");
      }
      return;
    }
    if (!note) {
      note = Object.assign(document.createElement("p"), { className: "error", id: `f-${name}-live` });
      note.dataset.live = "";
      note.setAttribute("role", "status");
      (field.querySelector("output") ?? input.parentElement).after(note);
    }
    if (note.textContent !== sentence) note.textContent = sentence;
    input.setAttribute("aria-invalid", "true");
  }
});
