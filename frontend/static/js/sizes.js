// Sizes as people type and read them beside a form.

export const MINUS = "\u2212";

/** What is typed, as a number of mm; null if empty, NaN if it is none. A comma is a point, as the server has it. */
export function typed(text) {
  const cleaned = text.trim().replaceAll(MINUS, "-").replaceAll(",", ".").replaceAll("\u00a0", "");
  if (cleaned === "") return null;
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(cleaned) ? Number(cleaned) : NaN;
}
/** A number, and not one that is none. */
export const usable = (value) => value !== null && Number.isFinite(value);
/** Whole nanometres, so that 0.1 + 0.2 is 0.3. */
export const nanometres = (mm) => Math.round(mm * 1e6);
/** At least four decimals, none hidden: 0.0090 mm. */
export const millimetres = (mm) => `${mm.toFixed(9).replace(/(\.\d{4}\d*?)0+$/, "$1")} mm`;
/** As many digits as it has, and no more. */
export const plain = (value, digits = 6) => String(Number(value.toPrecision(digits)));
/** A deviation without its sign: µm below a millimetre. */
export const deviation = (mm) => (Math.abs(mm) >= 1 ? `${plain(Math.abs(mm), 4)}\u00a0mm` : `${plain(Math.abs(mm) * 1000, 4)}\u00a0µm`);
/** A size with four decimals and its sign. */
export const size = (mm) => `${mm < 0 ? MINUS : ""}${Math.abs(mm).toFixed(4)}`;
