// A picker of a machine or a period (<details class="picker">, class "period-picker") is closed by Escape, and by a click
// beside it.

const opened = () => document.querySelector("details:is(.period-picker, .picker)[open]");

document.addEventListener("keydown", (event) => {
  const picker = event.key === "Escape" && opened();
  if (!picker) return;
  picker.open = false;
  picker.querySelector("summary").focus();
});
document.addEventListener("pointerdown", ({ target }) => {
  const picker = opened();
  if (picker && !picker.contains(target)) picker.open = false;
});
