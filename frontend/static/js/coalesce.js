// coalesced(work, pause) -> ask(): runs the async `work` at once, then at most once per `pause` ms however often it is asked,
// never twice at the same time, and never for a page nobody sees; a last ask is never forgotten.

export function coalesced(work, pause = 1_000) {
  let running = false;
  let asked = false;

  async function run() {
    if (document.hidden) return; // visibilitychange below brings it back
    running = true;
    asked = false;
    const started = performance.now();
    try {
      await work();
    } finally {
      setTimeout(() => {
        running = false;
        if (asked) run();
      }, Math.max(0, pause - (performance.now() - started)));
    }
  }
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden && asked && !running) run();
  });
  return () => {
    asked = true;
    if (!running) run();
  };
}
