// <choose-all data-all="All" data-none="None" [data-filter="…"]>…checkboxes…</choose-all> – two buttons that tick all or none of those
// of its checkboxes that are shown, and with data-filter a field that shows only those in whose label its words stand.
// Without script there are no buttons; the checkboxes work as they are.

class ChooseAll extends HTMLElement {
  connectedCallback() {
    if (this.tools) return;
    this.tools = Object.assign(document.createElement("div"), { className: "row" });
    if (this.dataset.filter) this.tools.append(this.filterField());
    for (const [text, ticked] of [[this.dataset.all, true], [this.dataset.none, false]]) {
      const button = Object.assign(document.createElement("button"), { type: "button", className: "button", textContent: text });
      button.addEventListener("click", () => {
        for (const box of this.querySelectorAll("input[type=checkbox]")) if (!box.closest("[hidden]")) box.checked = ticked;
      });
      this.tools.append(button);
    }
    this.prepend(this.tools);
  }

  filterField() {
    const label = Object.assign(document.createElement("label"), { className: "table-filter" });
    const field = Object.assign(document.createElement("input"), { type: "search" });
    field.addEventListener("input", () => this.show(field.value.toLowerCase().split(/\s+/).filter(Boolean)));
    field.addEventListener("keydown", (event) => event.key === "Enter" && event.preventDefault()); // it sends no form
    label.append(this.dataset.filter, " ", field);
    return label;
  }

  show(words) {
    for (const group of this.querySelectorAll("[data-group]")) {
      const name = group.dataset.group.toLowerCase();
      const labels = [...group.querySelectorAll("label")];
      for (const label of labels) {
        const text = `${name} ${label.textContent.toLowerCase()}`;
        label.hidden = !words.every((word) => text.includes(word));
      }
      group.hidden = labels.every((label) => label.hidden);
    }
  }
}
customElements.define("choose-all", ChooseAll);
