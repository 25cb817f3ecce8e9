// The numbers of a design that a study can vary, with the words that the form has for them.

import { at, changed, lobesOf } from './design.js';
import { fieldsOf, fullLabel, nameOf } from './field.js';
import { GROUPS } from './fields.js';

/** What changes the drawing of a profile or the sampling of a sweep is no parameter of the drive. */
const NO_PARAMETERS = ['/sweep', '/profile', '/accuracy', '/assembly'];

/** Follows from the number of slots and of lobes. */
const RING_TEETH = '/drive/ring/teeth';
const LEADS_RING_TEETH = new Set(['/drive/teeth/count', '/drive/wave_generator/lobes']);

/** Share of the value on either side that a range spans at first, and whole numbers on either side. */
const SPAN = 0.4;
const NARROW_SPAN = 0.04;
const WHOLE_SPAN = 8;

/** `[{ pointer, label, unit, group, isWhole, value }]` of a design. */
export function parametersOf(design) {
  const found = [];
  for (const group of GROUPS) {
    if (NO_PARAMETERS.some((root) => group.pointer.startsWith(root))) continue;
    for (const field of fieldsOf(group)) {
      if (field.kind !== 'number' || field.derived || NO_PARAMETERS.some((root) => field.pointer.startsWith(root))) continue;
      const value = at(design, field.pointer) ?? field.preset;
      const isLed = field.pointer === RING_TEETH;
      if (typeof value !== 'number' || isLed) continue;
      found.push({ pointer: field.pointer, label: fullLabel(field), unit: field.unit ?? '', group: group.title, isWhole: field.whole === true, value, isNarrow: field.slider < 0.1 });
    }
  }
  return found;
}

export const parameterOf = (design, pointer) => parametersOf(design).find((parameter) => parameter.pointer === pointer);

/** A number of the document in words, `{ label, unit }`; one that the form does not have by the name that the document has for it. */
export function wordsOf(pointer) {
  const field = GROUPS.flatMap(fieldsOf).find((candidate) => candidate.pointer === pointer);
  if (field) return { label: fullLabel(field), unit: field.unit ?? '' };
  return nameOf(pointer, 1);
}

const tidy = (value) => Number(value.toPrecision(4));

/** The range that a parameter spans at first. */
export function rangeOf({ value, isWhole, isNarrow }) {
  if (isWhole) return { min: Math.max(1, value - WHOLE_SPAN), max: value + WHOLE_SPAN };
  if (value === 0) return { min: 0, max: 10 };
  const half = Math.abs(value) * (isNarrow ? NARROW_SPAN : SPAN);
  return { min: tidy(value - half), max: tidy(value + half) };
}

/** Whether the ring's teeth have to follow when this one varies. */
const leads = (design, pointers) => pointers.some((pointer) => LEADS_RING_TEETH.has(pointer)) && at(design, '/drive/teeth/count') > at(design, RING_TEETH);

/** The design as a study's base: what follows from what varies is left out. */
export const baseOf = (design, pointers) => (leads(design, pointers) ? changed(design, RING_TEETH, undefined) : design);

/** The design with other values of these parameters, and what follows from them. */
export function withValues(design, values) {
  let next = design;
  for (const [pointer, value] of values) next = changed(next, pointer, value);
  if (leads(design, values.map(([pointer]) => pointer))) next = changed(next, RING_TEETH, at(next, '/drive/teeth/count') - lobesOf(next));
  return next;
}
