// <notify-here>: a form whose button data-asks first asks the browser to permit notifications. It says plainly where that cannot be.
//
//   data-insecure, data-missing, data-refused   why this browser shows none: no secure context, no notifications, not permitted
//   data-dismissed                              the question was closed without an answer
//   data-ready                                  the browser permits them
//   <p role="status" hidden>                    where that is said
//   data-receiver                               the person has it already; then the button is hidden where the browser permits it

class NotifyHere extends HTMLElement {
  connectedCallback() {
    this.button = this.querySelector("[data-asks]");
    this.onsubmit = (event) => {
      if (event.submitter !== this.button || globalThis.Notification?.permission === "granted") return;
      event.preventDefault();
      this.ask(event.target);
    };
    this.look();
  }

  look() {
    const { insecure, missing, refused, ready } = this.dataset;
    const permission = globalThis.Notification?.permission;
    const trouble = !isSecureContext ? insecure : !permission ? missing : permission === "denied" ? refused : "";
    this.button.hidden = Boolean(trouble) || (permission === "granted" && "receiver" in this.dataset);
    this.say(trouble || (this.button.hidden ? ready : ""));
  }

  async ask(form) {
    const answer = await Notification.requestPermission();
    if (answer === "granted") form.submit();
    else if (answer === "default") this.say(this.dataset.dismissed);
    else this.look();
  }

  say(words) {
    const line = this.querySelector("[role=status]");
    line.textContent = words;
    line.hidden = !words;
  }
}
customElements.define("notify-here", NotifyHere);
