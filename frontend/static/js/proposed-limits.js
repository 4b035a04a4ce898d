// What is proposed for a size or a name as it is typed, and for limits that are left empty (zone-diagram.js).

import { here } from "./root.js";
import { typed } from "./sizes.js";

async function asked(path, words) {
  const answer = await fetch(`${here(path)}?${new URLSearchParams(words)}`).catch(() => null);
  return answer?.ok ? answer.json() : {};
}

/** Nominal size and deviations of a tolerance class such as 40 h6, by the server's tables of ISO 286; {} if it has no such class.
 *  null: there is no class in it, or something else is typed by now. */
export async function ofClass(form, size) {
  if (!/[a-z]/i.test(size)) return null;
  const numbers = await asked("/setup/fit", { size: size.slice(0, 40) });
  return form.elements.nominal.value === size ? numbers : null;
}

/** The size in a name such as Bore 30 H7; 0 and the natural limit for Run-out. null: something is typed, chosen or, at 0, corrected by a tool. */
async function ofName(form, name) {
  const fields = form.elements;
  const isUntouched = () => ["nominal", "upper_deviation", "lower_deviation", "natural_limit", "target", "tolerance_width"]
    .every((each) => !fields[each].value) && fields.name.value === name;
  if (!name || !isUntouched()) return null;
  const values = await asked("/setup/named", { name: name.slice(0, 200) });
  return isUntouched() && !(values.natural_limit && typed(fields.tool_memory.value)) ? values : null;
}

/** What the name proposes, until one of the values is typed over; fill(values): writes them. [data-proposed] says so meanwhile. */
export class NameProposal {
  constructor(form, fill) {
    this.form = form;
    this.fill = fill;
  }

  /** Of another name something else is proposed: what was proposed before, and not typed over, goes. */
  async of(name) {
    if (this.values) this.fill(Object.fromEntries(Object.keys(this.values).map((each) => [each, ""])));
    this.show(null);
    const values = await ofName(this.form, name);
    if (!values || !Object.keys(values).length) return;
    this.show(values);
    this.fill(values);
  }

  typedOver(name) {
    if (this.values && name in this.values) this.show(null);
  }

  show(values) {
    this.values = values;
    const words = this.form.querySelector("[data-proposed]");
    if (words) words.hidden = !values;
  }
}

/** Limits of a new characteristic, mm, as `app/core/suggested.py` has them; the signal path may ask for more. */
export function ofTolerance(half) {
  const wear = Math.max(0.3, half);
  return { zero_range: Math.min(Math.max(0.001, half / 10), half / 3), wear_limit: wear, confidence_limit: Math.max(1, wear) };
}

/** -1, 0 or 1: the side of the natural limit; where none is chosen as the server has it: 0 at best, no minus, nothing corrected. */
export function naturalSide(form, values) {
  const { natural_limit: chosen, tool_memory: tool, mode } = form.elements;
  if (chosen?.value) return { lower: -1, upper: 1 }[chosen.value] ?? 0;
  const measures = !typed(tool?.value ?? "") || mode?.value === "measure_only";
  return chosen && measures && values.nominal === 0 && values.lower_deviation === 0 && values.upper_deviation > 0 ? -1 : 0;
}
