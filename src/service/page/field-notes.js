// What stands at the fields of a form: faults in what was typed, why the drive cannot exist, findings, and what an edit changed beside.

import { isSame } from './design.js';
import { html, setChildren } from './dom.js';
import { fieldsOf, fullLabel } from './field.js';
import { explanation, titleOf } from './findings.js';
import { number } from './format.js';
import { labelled, listed, small, t } from './texts.js';
import { sentence } from './words.js';

/** Faults whose limit is itself a value that would do. */
const LIMIT_WOULD_DO = new Set(['tooth_difference', 'installed_no_divisor', 'out_of_range', 'clearance_not_monotone']);

/** The id of what a field has. */
export const idOf = (pointer, what) => `${what}${pointer.replaceAll('/', '-')}`;

export class FieldNotes {
  reasons = [];
  findings = [];
  /** What the last edit changed beside its own field: `{ pointer, differences }`. */
  told;
  #elements = new Map();
  #built = new Map();

  /** `fields` are entries `{ field, element, input, fault }` by pointer, `groups` are `{ group, details }`. Actions are `isHeld()`, `fix(pointer, value)`,
   *  `keepOnly(place, field)`, `search()` and `remedyButton(finding)`. */
  constructor(container, fields, groups, actions) {
    Object.assign(this, { container, fields, groups, actions });
  }

  /** The place of a field's notes. */
  add(pointer, parent) {
    const notes = html('div', { class: 'notes', id: idOf(pointer, 'notes') });
    this.#elements.set(pointer, notes);
    parent.append(notes);
    return notes;
  }

  /** The field or group that stands nearest above a pointer. */
  placeOf(pointer) {
    let place = pointer;
    while (place && (!this.#elements.has(place) || this.fields.get(place)?.element.hidden)) {
      place = place.slice(0, place.lastIndexOf('/'));
    }
    return place;
  }

  /** What a field without a value wants, where it has to have one. */
  #wantOf({ field, element, input }) {
    const isWanted = !field.kind || field.kind === 'number';
    if (!isWanted || field.optional || field.derived || field.preset !== undefined || element.hidden || input.value !== '') return undefined;
    const kind = field.whole ? t('fault.whole') : t('fault.number', { unit: field.unit });
    const likely = field.likely === undefined ? '' : t('fault.likely', { value: field.likely });
    return t('fault.wanted', { what: small(field.label), kind, likely });
  }

  /** What there is to say by field: `contents` and the `worst` severity, with all notes as they are `built`. */
  #gathered() {
    const contents = new Map([...this.#elements.keys()].map((pointer) => [pointer, []]));
    const [worst, built] = [new Map(), new Map()];
    // What was built stays as long as it is wanted, with the focus that may be in it.
    const add = (pointer, severity, key, build) => {
      const id = `${pointer} ${key}`;
      const note = this.#built.get(id) ?? build();
      built.set(id, note);
      contents.get(pointer).push(note);
      if (!worst.has(pointer)) worst.set(pointer, severity);
      return note;
    };
    for (const [pointer, entry] of this.fields) {
      const text = entry.fault ?? this.#wantOf(entry);
      if (text) add(pointer, 'problem', text, () => ({ element: html('p', { class: 'note problem' }, text) }));
    }
    for (const reason of this.reasons) {
      const place = this.placeOf(reason.pointer);
      // An empty field has said so itself.
      if (reason.code === 'missing_field' && place === reason.pointer && contents.get(place).length > 0) continue;
      add(place, 'problem', JSON.stringify(reason), () => ({ element: this.#problemNote(reason, place) }));
    }
    if (this.told?.differences.length > 0) add(this.placeOf(this.told.pointer), 'info', JSON.stringify(this.told), () => ({ element: this.#toldNote(this.told) }));
    for (const finding of this.findings) {
      // It stands at the field to change first; the others are only marked.
      const [place, ...others] = new Set(finding.pointers.map((pointer) => this.placeOf(pointer)));
      add(place, finding.severity, finding.key, () => this.#findingNote(finding, place)).show(finding);
      for (const other of others) if (!worst.has(other)) worst.set(other, finding.severity);
    }
    return { contents, worst, built };
  }

  show() {
    const { contents, worst, built } = this.#gathered();
    for (const [pointer, entry] of this.fields) {
      entry.element.dataset.state = worst.get(pointer) ?? '';
      if (worst.get(pointer) === 'problem') entry.input.setAttribute('aria-invalid', 'true');
      else entry.input.removeAttribute('aria-invalid');
    }
    // Colours follow at once; words, which take room, wait until the slider is let go.
    if (this.actions.isHeld()) return;
    this.#built = built;
    this.#inPlace(() => {
      for (const [pointer, notes] of contents) setChildren(this.#elements.get(pointer), notes.map((note) => note.element));
      for (const { group, details } of this.groups) {
        const pointers = [group.pointer, ...[...fieldsOf(group)].map((field) => field.pointer)];
        if (pointers.some((pointer) => worst.get(pointer) === 'problem')) details.open = true;
      }
    });
  }

  /** Keeps the field that has the focus where it is on the screen while others around it grow or shrink. */
  #inPlace(change) {
    const anchor = this.container.contains(document.activeElement) ? document.activeElement : undefined;
    const before = anchor?.getBoundingClientRect().top;
    change();
    if (!anchor?.isConnected) return;
    const moved = anchor.getBoundingClientRect().top - before;
    const scrolls = this.container.scrollHeight > this.container.clientHeight ? this.container : document.scrollingElement;
    if (moved !== 0) scrolls.scrollTop += moved;
  }

  #problemNote(reason, place) {
    const { pointer, code, detail, limit } = reason;
    const missing = pointer !== place && pointer;
    const note = html('p', { class: 'note problem' }, missing ? labelled(pointer, sentence(detail)) : sentence(detail), ' ');
    if (code === 'conflicting_fields') {
      for (const { field } of this.fields.get(place)?.field.options ?? []) {
        note.append(html('button', { type: 'button', class: 'link', onclick: () => this.actions.keepOnly(place, field) }, t('form.keep', { label: field.label.toLowerCase() })), ' ');
      }
    } else if (code === 'unknown_field') {
      note.append(html('button', { type: 'button', class: 'link', onclick: () => this.actions.fix(pointer, undefined) }, t('form.remove')));
    } else if (LIMIT_WOULD_DO.has(code) && limit !== undefined && pointer === place && !pointer.endsWith('poissons_ratio')) {
      note.append(html('button', { type: 'button', class: 'link', onclick: () => this.actions.fix(pointer, limit) }, t('form.set_to', { value: number(limit) })));
    }
    return note;
  }

  /** What an edit changed beside its own field. */
  #toldNote({ pointer, differences }) {
    const list = listed(differences.map(({ label, value, reference }) => t('form.changed', { label: small(label), before: reference, after: value })));
    const search = this.fields.get(pointer)?.field.offersSearch && html('button', { type: 'button', class: 'link', onclick: () => this.actions.search() }, t('form.search'));
    return html('p', { class: 'note info told-note' }, `${t('form.also_changed', { list })} `, search && [`${t('form.sizes_stay')} `, search]);
  }

  #findingNote(first, place) {
    const { key } = first;
    const panel = html('div', { id: `${idOf(place, 'why')}-${key}`, hidden: true });
    const button = html('button', { type: 'button', class: 'finding', 'aria-expanded': 'false', 'aria-controls': panel.id }, titleOf(first));
    button.addEventListener('click', () => {
      panel.hidden = !panel.hidden;
      button.setAttribute('aria-expanded', String(!panel.hidden));
    });
    const remedy = html('div', {});
    const element = html('div', {}, button, remedy, panel);
    let shown;
    const show = (finding) => {
      if (isSame(finding, shown)) return;
      shown = finding;
      element.className = `note ${finding.severity}`;
      setChildren(remedy, [this.actions.remedyButton(finding)].filter(Boolean));
      panel.replaceChildren(explanation(finding, (pointer) => this.labelOf(pointer), (pointer) => this.goTo(pointer)));
    };
    return { element, show };
  }

  labelOf(pointer) {
    const place = this.placeOf(pointer);
    const { field } = this.fields.get(place) ?? {};
    const found = this.groups.find(({ group }) => group.pointer === place);
    return field?.name ?? (field && fullLabel(field)) ?? found?.group.title ?? pointer;
  }

  /** Leads to a field: opens its group, moves the focus there. */
  goTo(pointer) {
    const place = this.placeOf(pointer);
    const visible = [...this.fields.entries()].find(([key, { element, input }]) => key.startsWith(place) && key.split('/').length > 2 && !element.hidden && !input.hidden);
    const { element, input } = this.fields.get(place)?.field.kind === 'number' ? this.fields.get(place) : (visible?.[1] ?? {});
    if (!element) return;
    element.closest('details').open = true;
    input.focus({ preventScroll: true });
    element.scrollIntoView({ block: 'center', behavior: 'auto' });
  }
}
