// <copy-text for="ID" done="Copied" failed="…"><button type="button" hidden>…</button></copy-text>: copies the text of a textarea or of another element.
//
//   for       the id of the element
//   done      what the button says for two seconds afterwards
//   failed    what it says where the browser does not let pages copy; the text is selected then, for Ctrl+C
//
// Without script the button stays hidden; the text can be selected and copied by hand all the same.

class CopyText extends HTMLElement {
  connectedCallback() {
    this.button = this.querySelector("button");
    this.label = this.button.querySelector("span");
    this.words = this.label.textContent;
    this.button.hidden = false;
    this.copying = () => this.copy();
    this.button.addEventListener("click", this.copying);
  }

  disconnectedCallback() {
    this.button.removeEventListener("click", this.copying);
    clearTimeout(this.timer);
  }

  async copy() {
    const area = document.getElementById(this.getAttribute("for"));
    let copied = true;
    try {
      // Only pages from https or the own computer may use the clipboard this way; a shop floor often has neither.
      if (navigator.clipboard) await navigator.clipboard.writeText(area.value ?? area.textContent);
      else copied = this.select(area) && document.execCommand("copy");
    } catch {
      copied = false;
    }
    if (!copied) this.select(area);
    this.say(this.getAttribute(copied ? "done" : "failed"));
  }

  select(area) {
    if (area.select) {
      area.focus();
      area.select();
    } else getSelection().selectAllChildren(area);
    return true;
  }

  say(words) {
    this.label.textContent = words;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => (this.label.textContent = this.words), 2000);
  }
}
customElements.define("copy-text", CopyText);
