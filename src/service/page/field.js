// The fields of a form: how they are made, and what a document says in them.
//
// What comes in several kinds, as a wave generator does, is a `variant`: its tag is chosen, and of all the fields only those of the
// chosen kind are shown. A kind may be `implied`: it is meant where the document has no tag, and then none is written; `otherwise` finds
// it where it depends on the design. A kind's field starts with its `start`, a value or what makes one of the design, where the document
// has none; a field's `preset` is what the service takes where nothing is given. What another kind changes beside itself, `adjust` does.
// Labels are texts by pointer, those of options by pointer and value, or by `text` where the value is none.

import { at } from './design.js';
import { KINDS } from './kinds.js';
import { capital, t, textOf } from './texts.js';

const label = (pointer) => t(`label.${pointer}`);
const withLabels = (pointer, options) => options.map((option) => ({ label: t(`option.${pointer}.${option.text ?? option.key ?? option.value}`), ...option }));

const UNITS = { mm: 'mm', um: 'µm', deg: '°', arcsec: '″', nm: 'N·m', mpa: 'MPa', gpa: 'GPa', rpm: '1/min' };

/** A field without a text, `{ label, unit }`, by the name that the document has for it within its first groups. */
export function nameOf(pointer, groups) {
  const parts = pointer.split('/').slice(1 + groups);
  const [, name, unit] = /^(.*?)(?:_([a-z]+))?$/.exec(parts.at(-1));
  const isUnit = unit in UNITS;
  const words = [...parts.slice(0, -1), isUnit ? name : parts.at(-1)].join(', ').replaceAll('_', ' ');
  return { label: capital(words), unit: isUnit ? UNITS[unit] : '' };
}

/** A kind in words, or by its name in the document. */
export const kindName = (pointer, value) => textOf(`option.${pointer}.${value}`) ?? capital(value.replaceAll('_', ' '));

/** The kinds that have no entry in the form, with the fields that the API document gives them. */
const otherKinds = (pointer, options, suits) => {
  const listed = new Set(options.map(({ value }) => value));
  return Object.entries(KINDS[pointer]).filter(([value]) => !listed.has(value)).map(([value, fields]) => ({
    value,
    suits,
    label: kindName(pointer, value),
    fields: fields.map(({ pointer: place, unit, choices, is_whole: isWhole, is_required: isRequired }) => {
      const own = { label: textOf(`label.${place}`) ?? nameOf(place, 2).label };
      if (choices) return { ...unlessSaid(place, choices.map((choice) => ({ value: choice, label: choice }))), ...own };
      return number(place, '', unit, { ...own, whole: isWhole, optional: isRequired ? undefined : () => '' });
    }),
  }));
};

export const number = (pointer, symbol, unit, more) => ({ kind: 'number', pointer, label: label(pointer), symbol, unit, ...more });
export const whole = (pointer, symbol, more) => ({ kind: 'number', whole: true, pointer, label: label(pointer), symbol, ...more });
export const choice = (pointer, options, more) => ({ kind: 'choice', pointer, label: label(pointer), options: withLabels(pointer, options), ...more });
/** A choice that need not be made: left out, the document says nothing. */
export const unlessSaid = (pointer, options) => choice(pointer, [{ value: '', label: t('option.not_given') }, ...options]);
/** What a document says with `true`, or, where it `starts` with an object, by having that object. */
export const flag = (pointer, more) => ({ kind: 'flag', pointer, label: label(pointer), ...more });
export const variant = (pointer, tag, options, more = {}) => ({
  kind: 'variant', pointer, tag, label: label(pointer), name: textOf(`name.${pointer}`), options: [...withLabels(pointer, options), ...otherKinds(pointer, options, more.othersSuit)], ...more,
});
/** An object with exactly one of several fields. */
export const oneOf = (pointer, options, more) => ({ kind: 'oneOf', pointer, label: label(pointer), name: textOf(`name.${pointer}`), options: withLabels(pointer, options), ...more });
export const lines = (pointer, columns) => ({ kind: 'lines', pointer, label: label(pointer), columns });

/** The title and the hint of a group of fields. */
export const group = (pointer) => ({ title: t(`group.${pointer}`), hint: textOf(`hint.${pointer}`), pointer });

/** A field's label where it stands without its group. */
export const fullLabel = ({ label: own, of }) => (of ? t('name.of', { label: own, of: of.toLowerCase() }) : own);

const MEANINGS = new Map(Object.values(KINDS).flatMap(Object.values).flat().map(({ pointer, meaning }) => [pointer, meaning]));

const PART = /(?<=\/|allowable_)(wave_generator|teeth|ring|carrier)(?=_runout|_n_per_mm$|_um$|_mpa$|$|\/[^/]*$)/;

/** What a field means. */
export const explanationOf = (pointer) => textOf(`explain.${pointer}`) ?? textOf(`explain.${pointer.replace(PART, '*')}`) ?? MEANINGS.get(pointer);

/** Every field that can stand in the form, with the group that holds it. */
export function fieldsOf({ parts, fields }) {
  const found = new Map();
  const add = (field) => {
    if (!found.has(field.pointer)) found.set(field.pointer, field);
    for (const option of field.options ?? []) for (const inner of option.fields ?? (option.field ? [option.field] : [])) add(inner);
  };
  for (const part of parts ?? [{ fields }]) part.fields.forEach(add);
  return [...found.values()];
}

/** Whether a document says what a flag stands for. */
export const isOn = ({ pointer, starts }, design) => (starts ? typeof at(design, pointer) === 'object' && at(design, pointer) !== null : at(design, pointer) === true);

/** The kind of a variant that a document has: the implied or first one where it has no tag, undefined where it has another. */
export function kindOf({ pointer, tag, options, otherwise }, design) {
  const given = at(design, pointer)?.[tag];
  if (given === undefined || given === null) return otherwise?.(design) ?? (options.find(({ implied }) => implied) ?? options[0]).value;
  return options.find(({ value }) => value === given)?.value;
}

/** The value of a variant when another kind is chosen: what does not belong to a kind stays, with the fields that both kinds have. */
export function keptBy({ pointer, tag, options }, kind, design) {
  const chosen = options.find(({ value }) => value === kind);
  // Of what stands deeper within, the object that holds it; what stands beside the variant is not its own.
  const keyOf = (field) => field.pointer.slice(pointer.length + 1).split('/')[0];
  const within = (fields) => fields.filter((field) => field.pointer.startsWith(`${pointer}/`));
  const own = new Map(within(chosen.fields).map((field) => [keyOf(field), field]));
  const others = new Set(within(options.flatMap(({ fields }) => fields)).map(keyOf).filter((key) => !own.has(key)));
  const kept = Object.entries(at(design, pointer) ?? {}).filter(([key]) => key !== tag && !others.has(key));
  const given = new Set(kept.map(([key]) => key));
  const starts = [...own].filter(([key, { start }]) => start !== undefined && !given.has(key)).map(([key, { start }]) => [key, typeof start === 'function' ? start(design) : start]);
  return { ...(chosen.implied ? {} : { [tag]: kind }), ...Object.fromEntries([...kept, ...starts]) };
}
