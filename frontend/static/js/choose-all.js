// <choose-all data-all="All" data-none="None">…checkboxes…</choose-all> – two buttons that tick all or none of its checkboxes.
// Without script there are no buttons; the checkboxes work as they are.

class ChooseAll extends HTMLElement {
  connectedCallback() {
    if (this.buttons) return;
    this.buttons = Object.assign(document.createElement("div"), { className: "row" });
    for (const [text, ticked] of [[this.dataset.all, true], [this.dataset.none, false]]) {
      const button = Object.assign(document.createElement("button"), { type: "button", className: "button", textContent: text });
      button.addEventListener("click", () => {
        for (const box of this.querySelectorAll("input[type=checkbox]")) box.checked = ticked;
      });
      this.buttons.append(button);
    }
    this.prepend(this.buttons);
  }
}
customElements.define("choose-all", ChooseAll);
