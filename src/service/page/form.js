// The form, built from the field table in design.js, with problems and findings at the fields that they point at.

import { GROUPS, at, changed, fieldsOf, fullLabel, isSame } from './design.js';
import { html, setChildren, setText, symbol } from './dom.js';
import { explanation, sentence, titleOf } from './findings.js';
import { number } from './format.js';

/** Faults whose limit is itself a value that would do. */
const LIMIT_WOULD_DO = new Set(['tooth_difference', 'installed_no_divisor', 'out_of_range', 'clearance_not_monotone']);

const SLIDER_STEPS = 250;

const idOf = (pointer, what) => `${what}${pointer.replaceAll('/', '-')}`;

/** The power of ten times 1, 2 or 5 next below a size. */
function niceStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].map((digit) => digit * power).find((step) => step <= size * 1.0001) ?? power;
}

const rounded = (value, step) => {
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Number((step * Math.round(value / step)).toFixed(places));
};

export class Form {
  #fields = new Map();
  #notes = new Map();
  #groups = [];
  #built = new Map();
  #onEdit;
  #onEnd;
  #design = {};
  #answers = {};
  #findings = [];

  /** `onEdit(design, gesture)` at each change; changes of one gesture are one step to undo; `onEnd()` ends it. */
  constructor(container, { onEdit, onEnd }) {
    this.container = container;
    this.#onEdit = onEdit;
    this.#onEnd = onEnd;
    const general = this.#notesFor('', container);
    general.classList.add('general');
    for (const group of GROUPS) container.append(this.#buildGroup(group));
  }

  #notesFor(pointer, parent) {
    const notes = html('div', { class: 'notes', id: idOf(pointer, 'notes') });
    this.#notes.set(pointer, notes);
    parent.append(notes);
    return notes;
  }

  #buildGroup(group) {
    const summary = html('span', { class: 'summary' });
    const details = html(
      'details',
      { class: 'group', open: group.open },
      html('summary', {}, html('h3', {}, group.title), summary),
    );
    if (group.hint) details.append(html('p', { class: 'hint' }, group.hint));
    // A field that is the whole group has the group's notes too.
    if (!(group.fields ?? []).some((field) => field.pointer === group.pointer)) this.#notesFor(group.pointer, details);
    for (const part of group.parts ?? [group]) {
      const set = html('div', { class: 'set', role: 'group', 'aria-label': part.title });
      if (group.parts) set.append(html('h4', {}, part.title), part.hint ? html('p', { class: 'hint' }, part.hint) : '');
      for (const field of part.fields) set.append(this.#buildField(field));
      details.append(set);
    }
    this.#groups.push({ group, details, summary });
    return details;
  }

  #buildField(field) {
    if (field.kind === 'choice') return this.#buildChoice(field, (value) => this.#edit(field.pointer, value));
    if (field.kind === 'variant') return this.#buildVariant(field);
    if (field.kind === 'oneOf') return this.#buildOneOf(field);
    if (field.kind === 'flag') return this.#buildFlag(field);
    return this.#buildNumber(field);
  }

  #edit(pointer, value) {
    this.#design = changed(this.#design, pointer, value);
    this.#onEdit(this.#design, pointer);
  }

  #buildChoice(field, choose) {
    const id = idOf(field.pointer, 'field');
    const select = html(
      'select',
      { id, 'aria-describedby': idOf(field.pointer, 'notes') },
      field.options.map(({ value, key, label }) => html('option', { value: value ?? key }, label)),
    );
    select.addEventListener('change', () => {
      choose(select.value);
      this.#onEnd();
    });
    const element = html('div', { class: 'field choice' }, html('label', { for: id }, field.label), select);
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, { field, element, input: select });
    return element;
  }

  /** A tagged object: its tag is chosen, the fields of the chosen kind follow. */
  #buildVariant(field) {
    const element = this.#buildChoice(field, (tag) => {
      const option = field.options.find(({ value }) => value === tag);
      const presets = option.fields.map(({ pointer, preset }) => [pointer.split('/').at(-1), preset]);
      this.#edit(field.pointer, { [field.tag]: tag, ...Object.fromEntries(presets) });
    });
    for (const option of field.options) {
      for (const inner of option.fields) element.append(this.#buildNumber(inner));
    }
    return element;
  }

  /** What the service does only where it is asked for it; left out, it is not. */
  #buildFlag(field) {
    const id = idOf(field.pointer, 'field');
    const input = html('input', { id, type: 'checkbox', 'aria-describedby': idOf(field.pointer, 'notes') });
    input.addEventListener('change', () => {
      this.#edit(field.pointer, input.checked || undefined);
      this.#onEnd();
    });
    const element = html('div', { class: 'field flag' }, input, html('label', { for: id }, field.label));
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, { field, element, input });
    return element;
  }

  /** An object with exactly one of several fields, and perhaps others that stay. */
  #buildOneOf(field) {
    const element = this.#buildChoice(field, (key) => {
      const given = field.options.find((option) => at(this.#design, option.field.pointer) !== undefined);
      const option = field.options.find((candidate) => candidate.key === key);
      const value = given && field.convert?.(at(this.#design, given.field.pointer), key, this.#answers);
      const others = Object.entries(at(this.#design, field.pointer) ?? {}).filter(([name]) => !field.options.some((candidate) => candidate.key === name));
      this.#edit(field.pointer, { [key]: Number.isFinite(value) ? Number(value.toPrecision(12)) : option.preset, ...Object.fromEntries(others) });
    });
    for (const option of field.options) element.append(this.#buildNumber(option.field));
    return element;
  }

  #buildNumber(field) {
    const id = idOf(field.pointer, 'field');
    const input = html('input', {
      id,
      type: 'number',
      inputmode: field.whole ? 'numeric' : 'decimal',
      step: field.step ?? (field.whole ? 1 : 'any'),
      autocomplete: 'off',
      'aria-describedby': `${field.unit ? `${idOf(field.pointer, 'unit')} ` : ''}${idOf(field.pointer, 'notes')}`,
    });
    const label = html('label', { for: id }, field.of && html('span', { class: 'hidden' }, `${field.of}: `), field.label, field.symbol && [' ', symbol(field.symbol)]);
    const unit = html('span', { class: 'unit', id: idOf(field.pointer, 'unit') }, field.unit ?? '');
    const element = html('div', { class: 'field number-field' }, label, html('span', { class: 'entry' }, input, unit));
    const entry = { field, element, input };
    if (field.slider) this.#addSlider(entry);
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, entry);
    input.addEventListener('input', () => {
      entry.isNoNumber = input.validity.badInput;
      if (entry.isNoNumber) this.#renderNotes();
      else this.#edit(field.pointer, input.value === '' ? undefined : Number(input.value));
    });
    input.addEventListener('change', () => this.#onEnd());
    return element;
  }

  #addSlider(entry) {
    const { field, element } = entry;
    entry.slider = html('input', { type: 'range', 'aria-label': `${field.label}, slider` });
    entry.mark = html('span', { class: 'mark', hidden: true, 'aria-hidden': 'true' });
    entry.markText = html('span', { class: 'mark-text' });
    element.append(html('div', { class: 'slider' }, entry.slider, entry.mark), field.mark ? entry.markText : '');
    entry.slider.addEventListener('input', () => {
      const value = rounded(Number(entry.slider.value), entry.step);
      entry.input.value = String(value);
      entry.isNoNumber = false;
      this.#edit(field.pointer, value);
    });
    entry.slider.addEventListener('change', () => {
      // At the end of its way the slider makes room beyond.
      const { value, min, max } = entry.slider;
      if (value === min || value === max) this.#span(entry, Number(value));
      this.#onEnd();
    });
  }

  #span(entry, value) {
    const half = Math.abs(value) * entry.field.slider || 1;
    entry.step = niceStep((2 * half) / SLIDER_STEPS);
    const low = Math.max(rounded(value - half, entry.step), entry.step);
    const high = rounded(value + half, entry.step);
    entry.slider.min = low;
    entry.slider.max = high;
    entry.slider.step = entry.step;
    entry.slider.value = value;
    entry.input.step = entry.step;
  }

  /** Shows a document; sliders span anew around its values where `respan` says that it is another one. */
  setDesign(design, { respan = false } = {}) {
    this.#design = design;
    for (const entry of this.#fields.values()) this.#showValue(entry, respan);
    for (const { group, summary } of this.#groups) setText(summary, group.summary?.(design) ?? '');
  }

  #showValue(entry, respan) {
    const { field, input } = entry;
    const design = this.#design;
    if (field.kind === 'variant') {
      const tag = at(design, field.pointer)?.[field.tag] ?? field.options[0].value;
      input.value = tag;
      for (const option of field.options) {
        for (const inner of option.fields) this.#fields.get(inner.pointer).element.hidden = option.value !== tag;
      }
      return;
    }
    if (field.kind === 'oneOf') {
      const given = field.options.filter((option) => at(design, option.field.pointer) !== undefined);
      input.value = (given[0] ?? field.options[0]).key;
      for (const option of field.options) {
        this.#fields.get(option.field.pointer).element.hidden = given.length ? !given.includes(option) : option !== field.options[0];
      }
      return;
    }
    if (field.kind === 'flag') {
      input.checked = at(design, field.pointer) === true;
      return;
    }
    if (field.kind === 'choice') {
      input.value = at(design, field.pointer) ?? field.options[0].value;
      return;
    }
    const value = at(design, field.pointer) ?? field.preset;
    const isShown = input.value !== '' && Number(input.value) === value;
    if (value === undefined || value === null) {
      if (!input.validity.badInput || document.activeElement !== input) input.value = '';
    } else if (!isShown) {
      input.value = typeof value === 'number' ? String(value) : '';
    }
    if (field.optional) input.placeholder = field.optional(design, this.#answers);
    if (entry.slider) {
      const isGiven = typeof value === 'number' && value > 0;
      entry.slider.parentElement.hidden = !isGiven;
      if (!isGiven) return;
      const { min, max } = entry.slider;
      if (respan || entry.step === undefined || value < Number(min) || value > Number(max)) this.#span(entry, value);
      else entry.slider.value = value;
      entry.slider.setAttribute('aria-valuetext', `${value} ${field.unit}`);
    }
  }

  /** Shows what the service says about the document. */
  setResult(answers, reasons, findings) {
    this.#answers = answers;
    this.reasons = reasons;
    this.#findings = findings;
    for (const entry of this.#fields.values()) {
      const { field } = entry;
      if (field.optional) entry.input.placeholder = field.optional(this.#design, answers);
      if (field.mark) this.#showMark(entry, field.mark(answers));
    }
    this.#renderNotes();
  }

  #showMark({ slider, mark, markText, field }, { value, text }) {
    setText(markText, value === undefined ? text : `${text} ${number(value, 4)} ${field.unit}`);
    const share = (value - Number(slider.min)) / (Number(slider.max) - Number(slider.min));
    mark.hidden = !(share >= 0 && share <= 1);
    mark.style.setProperty('--at', share);
  }

  /** The field or group that stands nearest above a pointer. */
  #placeOf(pointer) {
    let place = pointer;
    while (place && (!this.#notes.has(place) || this.#fields.get(place)?.element.hidden)) {
      place = place.slice(0, place.lastIndexOf('/'));
    }
    return place;
  }

  #renderNotes() {
    const contents = new Map([...this.#notes.keys()].map((pointer) => [pointer, []]));
    const worst = new Map();
    const built = new Map();
    // What was built stays as long as it is wanted, with the focus that may be in it.
    const add = (pointer, severity, key, build) => {
      const id = `${pointer} ${key}`;
      const note = this.#built.get(id) ?? build();
      built.set(id, note);
      contents.get(pointer).push(note);
      if (!worst.has(pointer)) worst.set(pointer, severity);
    };
    for (const reason of this.reasons ?? []) {
      const place = this.#placeOf(reason.pointer);
      add(place, 'problem', JSON.stringify(reason), () => ({ element: this.#problemNote(reason, place) }));
    }
    for (const [pointer, { isNoNumber }] of this.#fields) {
      if (isNoNumber) add(pointer, 'problem', 'no number', () => ({ element: html('p', { class: 'note problem' }, 'This is no number; the last one stands.') }));
    }
    for (const finding of this.#findings) {
      for (const place of new Set(finding.pointers.map((pointer) => this.#placeOf(pointer)))) {
        add(place, finding.severity, finding.key, () => this.#findingNote(finding, place));
        built.get(`${place} ${finding.key}`).show(finding);
      }
    }
    this.#built = built;
    for (const [pointer, notes] of contents) {
      setChildren(this.#notes.get(pointer), notes.map((note) => note.element));
      const entry = this.#fields.get(pointer);
      if (entry) {
        entry.element.dataset.state = worst.get(pointer) ?? '';
        if (worst.get(pointer) === 'problem') entry.input.setAttribute('aria-invalid', 'true');
        else entry.input.removeAttribute('aria-invalid');
      }
    }
    for (const { group, details } of this.#groups) {
      const pointers = [group.pointer, ...[...fieldsOf(group)].map((field) => field.pointer)];
      if (pointers.some((pointer) => worst.get(pointer) === 'problem')) details.open = true;
    }
  }

  #problemNote(reason, place) {
    const { pointer, code, detail, limit } = reason;
    const missing = pointer !== place && pointer ? `${pointer}: ` : '';
    const note = html('p', { class: 'note problem' }, `${missing}${sentence(detail)} `);
    if (code === 'conflicting_fields') {
      for (const { field } of this.#fields.get(place)?.field.options ?? []) {
        note.append(html('button', { type: 'button', class: 'link', onclick: () => this.#keepOnly(place, field) }, `Keep ${field.label.toLowerCase()}`), ' ');
      }
    } else if (code === 'unknown_field') {
      note.append(html('button', { type: 'button', class: 'link', onclick: () => this.#fix(pointer, undefined) }, 'Remove it'));
    } else if (LIMIT_WOULD_DO.has(code) && limit !== undefined && pointer === place && !pointer.endsWith('poissons_ratio')) {
      note.append(html('button', { type: 'button', class: 'link', onclick: () => this.#fix(pointer, limit) }, `Set to ${number(limit)}`));
    }
    return note;
  }

  #fix(pointer, value) {
    this.#edit(pointer, value);
    this.#settle(pointer);
  }

  /** Of the options of an object with exactly one of them. */
  #keepOnly(place, kept) {
    const others = this.#fields.get(place).field.options.filter(({ field }) => field !== kept);
    this.#edit(place, others.reduce((design, { field }) => changed(design, field.pointer, undefined), this.#design)[place.slice(1)]);
    this.#settle(kept.pointer);
  }

  #settle(pointer) {
    this.#onEnd();
    this.setDesign(this.#design);
    this.goTo(pointer);
  }

  #findingNote(first, place) {
    const { key, pointers } = first;
    const panel = html('div', { id: `${idOf(place, 'why')}-${key}`, hidden: true });
    const button = html('button', { type: 'button', class: 'finding', 'aria-expanded': 'false', 'aria-controls': panel.id }, titleOf(first));
    button.addEventListener('click', () => {
      panel.hidden = !panel.hidden;
      button.setAttribute('aria-expanded', String(!panel.hidden));
    });
    const element = html('div', {}, button, panel);
    // The first field is the one to change first; the others only refer to the finding.
    const isMinor = this.#placeOf(pointers[0]) !== place;
    let shown;
    const show = (finding) => {
      if (isSame(finding, shown)) return;
      shown = finding;
      element.className = `note ${finding.severity}${isMinor ? ' minor' : ''}`;
      panel.replaceChildren(explanation(finding, (pointer) => this.labelOf(pointer), (pointer) => this.goTo(pointer)));
    };
    return { element, show };
  }

  labelOf(pointer) {
    const place = this.#placeOf(pointer);
    const { field } = this.#fields.get(place) ?? {};
    const group = GROUPS.find((candidate) => candidate.pointer === place);
    return field?.name ?? (field && fullLabel(field)) ?? group?.title ?? pointer;
  }

  /** Leads to a field: opens its group, moves the focus there. */
  goTo(pointer) {
    const place = this.#placeOf(pointer);
    const visible = [...this.#fields.entries()].find(([key, { element }]) => key.startsWith(place) && key.split('/').length > 2 && !element.hidden);
    const { element, input } = this.#fields.get(place)?.field.kind === 'number' ? this.#fields.get(place) : (visible?.[1] ?? {});
    if (!element) return;
    element.closest('details').open = true;
    input.focus({ preventScroll: true });
    element.scrollIntoView({ block: 'center', behavior: 'auto' });
  }
}
