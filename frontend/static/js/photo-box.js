// <photo-box src="/alarms/12/photos">: photos that go with the form around them, taken one by one or chosen several at once.
//
// Each is scaled to 1600 points in the browser and shown with its size. The form is sent first, as if there were no photo; then
// each photo by itself, with the same person. A photo that cannot be sent changes nothing of what the form has done: it says why,
// and is sent again or left out. In a form sent to `src` itself its button asks for a photo as long as there is none.
// Without script the box stays hidden; a plain field of files stands beside it ([data-plain]), or on the page of the alarm.

const LONGEST = 1600;
const OF_PERSON = ["csrf", "who", "other_name", "pin", "badge"];
const fill = (words, values) => words.replace(/\{(\w+)\}/g, (_all, name) => values[name]);
const reason = (page) => page.querySelector(".problem h1 + p, .problem h1, h1")?.textContent.trim() ?? ""; // what a page says is wrong
const sizeOf = (bytes) => (bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

async function scaled(file) {
  const picture = await createImageBitmap(file, { imageOrientation: "from-image" });
  const scale = Math.min(1, LONGEST / Math.max(picture.width, picture.height));
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(picture.width * scale);
  canvas.height = Math.round(picture.height * scale);
  const context = canvas.getContext("2d");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(picture, 0, 0, canvas.width, canvas.height);
  picture.close();
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no picture"))), "image/jpeg", 0.82));
}

class PhotoBox extends HTMLElement {
  photos = [];
  wentTo = null; // where the form has led, once it is sent

  connectedCallback() {
    this.hidden = false;
    this.form = this.closest("form");
    this.alone = this.form.getAttribute("action") === this.getAttribute("src");
    this.form.querySelector("[data-plain]")?.remove();
    this.input = this.querySelector("input");
    this.choosing = () => this.choose([...this.input.files]);
    this.sending = (event) => this.submit(event);
    this.input.addEventListener("change", this.choosing);
    this.form.addEventListener("submit", this.sending);
  }

  disconnectedCallback() {
    this.input.removeEventListener("change", this.choosing);
    this.form.removeEventListener("submit", this.sending);
  }

  async choose(files) {
    this.say("");
    for (const file of files) {
      try {
        this.show(await scaled(file));
      } catch {
        this.say(fill(this.dataset.unreadable, { name: file.name }));
      }
    }
    this.input.value = ""; // the same one may be taken again
  }

  show(blob) {
    const address = URL.createObjectURL(blob);
    const item = document.createElement("li");
    const image = Object.assign(document.createElement("img"), { src: address, alt: "" });
    const size = Object.assign(document.createElement("span"), { textContent: sizeOf(blob.size) });
    const remove = Object.assign(document.createElement("button"), { type: "button", className: "button", textContent: this.dataset.remove });
    const photo = { blob, gone: () => (item.remove(), URL.revokeObjectURL(address)) };
    remove.addEventListener("click", () => {
      this.photos = this.photos.filter((each) => each !== photo);
      photo.gone();
    });
    item.append(image, size, remove);
    this.querySelector(".photos").append(item);
    this.photos.push(photo);
  }

  async submit(event) {
    if (!this.photos.length && !this.alone) return;
    event.preventDefault();
    if (!this.photos.length && this.wentTo === null) return void this.input.click();
    if (this.busy) return;
    this.busy = true;
    this.say("");
    try {
      if (this.wentTo === null && !this.alone && !(await this.sendForm())) return;
      await this.sendPhotos();
      if (this.alone) location.reload();
      else location.assign(this.wentTo);
    } catch (error) {
      this.fail(error instanceof TypeError || error.name === "TimeoutError" ? this.dataset.trouble : error.message);
    } finally {
      this.busy = false;
    }
  }

  /** Send what the person has typed; false where it came back with something to put right. */
  async sendForm() {
    const answer = await fetch(this.form.getAttribute("action"), { method: "POST", body: new URLSearchParams(new FormData(this.form)), signal: AbortSignal.timeout(30_000) });
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const asked = page.getElementById("confirm");
    if (answer.redirected && !asked) {
      this.wentTo = answer.url;
      if (!/[?&](done|late)=/.test(answer.url)) location.assign(answer.url); // signed out meanwhile
      return true;
    }
    if (!asked) throw new Error(reason(page));
    const part = document.adoptNode(asked);
    part.querySelector("photo-box").replaceWith(this);
    document.getElementById("confirm").replaceWith(part);
    part.querySelector("[aria-invalid], .note, .error:not([hidden])")?.scrollIntoView({ block: "nearest" });
    return false;
  }

  async sendPhotos() {
    const all = this.photos.length;
    for (let n = 1; this.photos.length; n += 1) {
      this.say(fill(this.dataset.sending, { n, all }), false);
      const body = new FormData();
      for (const [name, value] of new FormData(this.form)) if (OF_PERSON.includes(name)) body.append(name, value);
      body.append("photo", this.photos[0].blob, "photo.jpg");
      const answer = await fetch(this.getAttribute("src"), { method: "POST", body, headers: { "X-Sent-By": "script" }, signal: AbortSignal.timeout(120_000) });
      if (answer.status !== 204) throw new Error(reason(new DOMParser().parseFromString(await answer.text(), "text/html")));
      this.photos.shift().gone();
    }
    this.say("");
  }

  say(words, wrong = true) {
    const line = this.querySelector(".photo-said");
    line.classList.toggle("error", wrong);
    line.textContent = words;
    line.hidden = !words;
  }

  fail(why) {
    this.say(fill(this.wentTo === null ? this.dataset.failed : this.dataset.kept, { why }));
    if (this.wentTo === null) return;
    // The form has done what it does: what is left is the photos.
    const actions = this.form.querySelector(".actions");
    const again = Object.assign(document.createElement("button"), { className: "button primary big", textContent: this.dataset.again });
    const on = Object.assign(document.createElement("a"), { className: "button big", href: this.wentTo, textContent: this.dataset.on });
    actions.replaceChildren(again, on);
    this.scrollIntoView({ block: "nearest" });
  }
}

customElements.define("photo-box", PhotoBox);
