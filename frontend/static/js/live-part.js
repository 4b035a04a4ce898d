// <live-part id="…" src="URL" on="reading:shaft-d40 alarm" [now]>…</live-part>
// A part of the page that is fetched again when a matching live event arrives (at most once a second).
//
//   src   where it comes from; the page's own URL if left out. If the answer holds an element with this element's id,
//         that element's content is taken (so a whole page will do), else all of its body.
//   on    see live.js
//   now   fetch at once, too
//   every seconds between two looks where no event tells of a change
//   still the items of a list that is worked with fingers, as a selector: while somebody is near (moves or touches something in
//         it, within two seconds), nothing is swapped, and how many items are new is said ("1 new", data-new="{n} new"; a touch
//         shows them). Where a swap has moved the items, a touch counts only when they have stood still for a moment
//
// What the reader is doing is kept: focus, selection, opened <details> (those with an id or data-key), scrolling.
// While he types in it, presses something in it or has a dialog or a popover of it open, it waits. If fetching fails it says so and how
// old the content is. Fires "livepart" (bubbles) after each swap.

import { coalesced } from "./coalesce.js";
import { afterEvent, subscribe } from "./live.js";
import { age } from "./times.js";

const NEAR = 2_000; // ms after the last movement
const SETTLED = 500; // ms after a swap; a finger that was on its way meant what stood there before
const PRESS = 1_500; // ms from the first touch on; what is swapped between press and release would never be clicked

const key = (element) => element.id || element.dataset.key || element.name || "";
const same = (root, name, type) =>
  name && [...root.querySelectorAll(type)].find((element) => key(element) === name);

class LivePart extends HTMLElement {
  connectedCallback() {
    this.fetched = Date.now();
    this.addEventListener("pointerdown", this.onPress ??= () => (this.pressed = performance.now()), true);
    if (this.hasAttribute("still")) this.watch();
    this.refresh = coalesced(() => this.load());
    this.stop = subscribe(this.getAttribute("on"), () => this.refresh());
    if (this.hasAttribute("now")) this.refresh();
    const every = Number(this.getAttribute("every"));
    if (every) this.timer = setInterval(() => document.hidden || this.refresh(), every * 1_000);
  }

  disconnectedCallback() {
    this.stop?.();
    clearInterval(this.timer);
  }

  /** Once: notes movements of fingers, mouse and wheel. */
  watch() {
    if (this.watching) return;
    this.watching = true;
    for (const type of ["pointermove", "pointerdown", "wheel", "keydown"])
      this.addEventListener(type, () => (this.moved = performance.now()), { capture: true, passive: true });
  }

  /** Keeps touches off what has just moved there (pointer-events in components.css). */
  settle() {
    this.setAttribute("settling", "");
    clearTimeout(this.settled);
    this.settled = setTimeout(() => this.removeAttribute("settling"), SETTLED);
  }

  get near() {
    return performance.now() - this.moved < NEAR && !this.wanted;
  }

  items(root) {
    const items = this.hasAttribute("still") ? root.querySelectorAll(this.getAttribute("still")) : [];
    return [...items].map((item) => item.id || item.dataset.key || item.getAttribute("aria-labelledby"));
  }

  /** Says how many items wait to be shown. */
  announce(fresh) {
    const here = new Set(this.items(this));
    const count = this.items(fresh).filter((item) => !here.has(item)).length;
    let news = this.querySelector(".still-news");
    if (!count) return void news?.remove();
    if (!news) {
      news = Object.assign(document.createElement("div"), { className: "still-news" });
      news.setAttribute("role", "status");
      const button = Object.assign(document.createElement("button"), { type: "button", className: "button primary big" });
      button.addEventListener("click", () => {
        [this.wanted, this.pressed] = [true, undefined];
        this.refresh();
      });
      news.append(button);
      this.append(news);
    }
    const words = this.dataset.new.replace("{n}", count);
    if (news.textContent !== words) news.firstChild.textContent = words;
  }

  get busy() {
    const active = document.activeElement;
    const typing = this.contains(active) && active.matches("input:not([type=hidden]), textarea, select");
    return typing || performance.now() - this.pressed < PRESS || this.querySelector("dialog[open], :popover-open") !== null;
  }

  async load() {
    if (this.busy) return void setTimeout(() => this.isConnected && this.refresh(), 1_000);
    try {
      const answer = await fetch(this.getAttribute("src") || location.href, {
        headers: { "X-Live-Part": this.id || "yes", ...afterEvent() },
        signal: AbortSignal.timeout(60_000), // a line that swallows everything would keep the part from ever asking again
      });
      if (!answer.ok) throw new Error(`${answer.status}`);
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      if (this.busy) return void this.refresh();
      const fresh = (this.id && page.getElementById(this.id)) || page.body;
      if (this.near) {
        this.announce(fresh);
        return void setTimeout(() => this.isConnected && this.refresh(), 1_000);
      }
      const [before, after] = [this, fresh].map((root) => this.items(root).join());
      this.swap(fresh);
      if (before !== after) this.settle();
      this.wanted = false;
      this.fetched = Date.now();
      for (const name of ["stale", "title"]) this.removeAttribute(name);
    } catch {
      this.setAttribute("stale", "");
      this.setAttribute("title", age((Date.now() - this.fetched) / 1000));
      setTimeout(() => this.isConnected && this.refresh(), 5_000);
    }
  }

  swap(fresh) {
    const opened = [...this.querySelectorAll("details")].map((details) => [key(details), details.open]);
    const scrolled = [...this.querySelectorAll("[id], .table-wrap")].filter((e) => e.scrollTop || e.scrollLeft)
      .map((e) => [e.id, e.scrollLeft, e.scrollTop]);
    const focused = this.contains(document.activeElement) ? document.activeElement : null;
    const focus = focused && [key(focused), focused.localName, focused.getAttribute("href")];

    this.replaceChildren(...document.adoptNode(fresh).childNodes);

    for (const [name, open] of opened) {
      const details = same(this, name, "details");
      if (details) details.open = open;
    }
    for (const [id, left, top] of scrolled) if (id) this.querySelector(`#${CSS.escape(id)}`)?.scrollTo(left, top);
    if (focus) {
      const [name, type, href] = focus;
      const again = same(this, name, type) ||
        (href && [...this.querySelectorAll("a")].find((link) => link.getAttribute("href") === href));
      again?.focus({ preventScroll: true });
    }
    this.dispatchEvent(new CustomEvent("livepart", { bubbles: true }));
  }
}

customElements.define("live-part", LivePart);
