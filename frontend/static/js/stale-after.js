// <stale-after at="ISO"><span class="fresh">…</span><span class="old">…</span></stale-after>
// Shows what is inside .fresh until the moment `at`, and what is inside .old from then on (attribute "stale"); a page
// nobody touches must not show an old state as if it were true. Without a connection (<html data-live="lost">) nothing is
// known to be true either: the style sheet shows .old then.

const waiting = new Set();

class StaleAfter extends HTMLElement {
  connectedCallback() {
    this.at = Date.parse(this.getAttribute("at"));
    if (Number.isNaN(this.at)) return;
    waiting.add(this);
    this.look();
  }

  disconnectedCallback() {
    waiting.delete(this);
  }

  look() {
    this.toggleAttribute("stale", Date.now() >= this.at);
  }
}

setInterval(() => waiting.forEach((one) => one.look()), 1_000);
customElements.define("stale-after", StaleAfter);
