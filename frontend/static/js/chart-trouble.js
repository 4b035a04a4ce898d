// ChartTrouble: says over a plotly-chart that it could not be brought up to date, and how old it is.
//
//   new ChartTrouble(chart, words)   words.trouble, and words.old with {age}
//   over()                           it is up to date       say(error)   it is not

import { age } from "./times.js";

export class ChartTrouble {
  constructor(chart, words) {
    Object.assign(this, { chart, words });
  }

  over() {
    this.fetched = Date.now();
    this.end();
  }

  end() {
    clearInterval(this.clock);
    this.note?.remove();
    this.note = null;
  }

  say(error) {
    this.note ??= this.chart.appendChild(Object.assign(document.createElement("div"), { className: "trouble" }));
    this.note.setAttribute("role", "status");
    const say = () => {
      const old = this.fetched ? this.words.old.replace("{age}", age((Date.now() - this.fetched) / 1000)) : "";
      this.note.textContent = `▲ ${this.words.trouble} (${error.message}) ${old}`;
    };
    clearInterval(this.clock);
    this.clock = setInterval(say, 1_000);
    say();
  }
}
