// <api-docs>: the documentation of the API.
// Typing in its search field leaves the operations that have all the words (in path, fields or sentences), "/" goes there;
// an operation that the address names (#push_reading) opens itself; all of them open to be printed.
// Attributes: data-none – what is said when nothing is left.

class ApiDocs extends HTMLElement {
  connectedCallback() {
    this.operations = [...this.querySelectorAll("details.operation")];
    this.texts = new Map(this.operations.map((each) => [each, each.textContent.toLowerCase()]));
    this.field = this.querySelector("input[type=search]");
    this.field.addEventListener("input", () => this.find(this.field.value));
    document.addEventListener("keydown", (event) => {
      if (event.key === "/" && !event.target.closest("input, textarea")) {
        event.preventDefault();
        this.field.focus();
      }
    });
    window.addEventListener("hashchange", () => this.openNamed());
    window.addEventListener("beforeprint", () => {
      this.opened = this.operations.filter((each) => each.open);
      for (const each of this.operations) each.open = true;
    });
    window.addEventListener("afterprint", () => {
      for (const each of this.operations) each.open = this.opened.includes(each);
    });
    this.openNamed();
    if (this.field.value) this.find(this.field.value);
  }

  find(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    let left = 0;
    for (const [operation, own] of this.texts) {
      operation.hidden = !words.every((word) => own.includes(word));
      this.querySelector(`.index li[data-for="${operation.id}"]`).hidden = operation.hidden;
      if (!operation.hidden) left += 1;
    }
    for (const part of this.querySelectorAll(".group, .index section")) {
      const inner = [...part.querySelectorAll("details.operation, li[data-for]")];
      part.hidden = inner.length > 0 && inner.every((each) => each.hidden);
    }
    this.querySelector(".none").textContent = left ? "" : this.dataset.none;
  }

  openNamed() {
    const named = this.operations.find((each) => each.id === location.hash.slice(1));
    if (!named) return;
    named.open = true;
    named.scrollIntoView();
  }
}

customElements.define("api-docs", ApiDocs);
