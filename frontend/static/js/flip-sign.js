// <flip-sign><input><button type="button" hidden>±</button></flip-sign>: the other sign at one touch, with gloves on.
//
// The number keypads of panels and phones often have no minus. Without script the button stays hidden; a minus is typed.

class FlipSign extends HTMLElement {
  connectedCallback() {
    this.input = this.querySelector("input");
    this.button = this.querySelector("button");
    this.button.hidden = false;
    this.flipping = () => this.flip();
    this.button.addEventListener("click", this.flipping);
  }

  disconnectedCallback() {
    this.button.removeEventListener("click", this.flipping);
  }

  flip() {
    const typed = this.input.value.trim();
    this.input.value = /^[-−]/.test(typed) ? typed.slice(1).trim() : `−${typed.replace(/^\+/, "").trim()}`;
    this.input.focus();
  }
}
customElements.define("flip-sign", FlipSign);
