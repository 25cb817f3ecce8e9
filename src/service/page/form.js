// The form, built from the field table in design.js, with problems and findings at the fields that they point at.

import { GROUPS, at, changed, fieldsOf, fullLabel, isOn, isSame, keptBy, kindOf } from './design.js';
import { linesOf, linesRead } from './lines.js';
import { html, setAttributes, setChildren, setProperties, setText, symbol } from './dom.js';
import { explanation, sentence, titleOf } from './findings.js';
import { number, typed } from './format.js';
import { remedyOf } from './remedies.js';
import { inputDifferences } from './report.js';
import { TERMS, explained } from './terms.js';
import { explanationOf } from './texts.en.js';

/** Faults whose limit is itself a value that would do. */
const LIMIT_WOULD_DO = new Set(['tooth_difference', 'installed_no_divisor', 'out_of_range', 'clearance_not_monotone']);

const SLIDER_STEPS = 250;

/** Sizes that a slider can span; beyond them no design is possible. */
const SPANNED = { least: 1e-12, most: 1e15 };

const idOf = (pointer, what) => `${what}${pointer.replaceAll('/', '-')}`;

/** The power of ten times 1, 2 or 5 next below a size. */
function niceStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].map((digit) => digit * power).find((step) => step <= size * 1.0001) ?? power;
}

const rounded = (value, step) => {
  const places = Math.min(100, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return Number((step * Math.round(value / step)).toFixed(places));
};

export class Form {
  #fields = new Map();
  #notes = new Map();
  #groups = [];
  #built = new Map();
  /** The field whose slider is held: as long as it is, nothing moves under the pointer. */
  #held;
  #onEdit;
  #onEnd;
  #design = {};
  #answers = {};
  #findings = [];
  #materials = [];
  #fillings = [];
  /** What the last edit changed beside its own field: `{ pointer, differences }`. */
  #told;

  /** `onEdit(design, gesture)` at each change; changes of one gesture are one step to undo; `onEnd()` ends it; `onSearch(design)` looks for a drive
   *  like it. All fields stand below the pointer `root`. */
  constructor(container, { onEdit, onEnd, onSearch }, groups = GROUPS, root = '') {
    this.container = container;
    this.groups = groups;
    this.#onEdit = onEdit;
    this.#onEnd = onEnd;
    this.onSearch = onSearch;
    const general = this.#notesFor(root, container);
    general.classList.add('general');
    for (const group of groups) container.append(this.#buildGroup(group));
    // Wherever the pointer is let go.
    for (const end of ['pointerup', 'pointercancel']) addEventListener(end, () => this.#release());
    container.addEventListener('keydown', (event) => {
      if (event.key !== 'F1') return;
      event.preventDefault();
      event.target.closest('.field')?.querySelector('.term')?.click();
    });
  }

  get isHeld() {
    return this.#held !== undefined;
  }

  #release() {
    if (!this.#held) return;
    this.#held = undefined;
    this.#renderNotes();
    this.#onEnd();
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
      if (part.filled) set.append(this.#buildFilling(part));
      for (const field of part.fields) set.append(this.#buildField(field));
      details.append(set);
    }
    this.#groups.push({ group, details, summary });
    return details;
  }

  /** What fills in a part's numbers by name; it is hidden until there are names. */
  #buildFilling({ filled, title }) {
    const select = html('select', { 'aria-label': `${title}: fill in a material` });
    const source = html('p', { class: 'hint', hidden: true });
    const element = html('div', { class: 'filling', hidden: true }, select, source);
    select.addEventListener('change', () => {
      const material = this.#materials.find(({ name }) => name === select.value);
      const { youngs_modulus_gpa, poissons_ratio, elasticity_source, allowable_stress_mpa: allowable, allowable_stress_source } = material;
      this.#edit(filled, { youngs_modulus_gpa, poissons_ratio });
      this.setDesign(this.#design);
      setText(source, `${elasticity_source}.${allowable === undefined ? ' No allowable Hertz stress is published.' : ` Allowable stress ${number(allowable)} MPa: ${allowable_stress_source}.`}`);
      source.hidden = false;
      select.value = '';
      this.#onEnd();
    });
    this.#fillings.push({ element, select });
    return element;
  }

  /** Offers materials by name, `{ name, title, youngs_modulus_gpa, … }`. */
  offerMaterials(materials) {
    this.#materials = materials;
    for (const { element, select } of this.#fillings) {
      select.replaceChildren(html('option', { value: '' }, 'Fill in a material…'), ...materials.map(({ name, title }) => html('option', { value: name }, title)));
      element.hidden = materials.length === 0;
    }
  }

  #buildField(field) {
    if (field.kind === 'choice') return this.#buildChoice(field, (chosen) => this.#choose(field, chosen));
    if (field.kind === 'variant') return this.#buildVariant(field);
    if (field.kind === 'oneOf') return this.#buildOneOf(field);
    if (field.kind === 'flag') return this.#buildFlag(field);
    if (field.kind === 'lines') return this.#buildLines(field);
    return this.#buildNumber(field);
  }

  /** `adjust` changes what follows from it. */
  #edit(pointer, value, adjust = (design) => design) {
    this.#replace(adjust(changed(this.#design, pointer, value)), pointer);
  }

  /** The document's value may be none, or no text. */
  #choose({ pointer, options, adjust }, chosen) {
    const { value } = options.find((option) => String(option.value) === chosen);
    this.#edit(pointer, value === '' ? undefined : value, adjust);
  }

  /** Takes another document, and tells what changes beside the field that was edited. */
  #replace(design, pointer) {
    const isOwn = (other) => other === pointer || other.startsWith(`${pointer}/`);
    this.#told = { pointer, differences: inputDifferences(design, this.#design).filter(({ pointer: other }) => !isOwn(other)) };
    this.#design = design;
    this.#onEdit(design, pointer);
  }

  /** A label with a mark that explains its field; F1 in the field opens it too, so that Tab goes from field to field. */
  #named(field, label) {
    const text = explanationOf(field.pointer);
    const terms = (field.terms ?? []).map((key) => TERMS[key]);
    if (!text && terms.length === 0) return label;
    const [base, index] = (field.symbol ?? '').split('_');
    const title = `${fullLabel(field)}${base ? `, ${base}${index ? `_${index}` : ''}` : ''}`;
    const mark = explained(...(text ? [{ title, text }] : []), ...terms);
    mark.tabIndex = -1;
    return html('span', { class: 'named' }, label, mark);
  }

  /** A button that applies the remedy of a finding, where that is a value. */
  remedyButton(finding) {
    const remedy = remedyOf(finding, this.#answers, this.#design);
    if (!remedy) return undefined;
    const apply = () => {
      this.#replace(remedy.change(this.#design), finding.pointers[0]);
      this.#onEnd();
      this.setDesign(this.#design);
    };
    return html('button', { type: 'button', class: 'remedy', onclick: apply }, remedy.label);
  }

  #buildChoice(field, choose) {
    const id = idOf(field.pointer, 'field');
    const select = html(
      'select',
      { id, 'aria-describedby': idOf(field.pointer, 'notes') },
      field.options.map(({ value, key, label }) => html('option', { value: String(value ?? key) }, label)),
    );
    select.addEventListener('change', () => {
      choose(select.value);
      this.#onEnd();
    });
    const label = html('div', { class: 'choice-label' }, this.#named(field, html('label', { for: id }, field.label)));
    const element = html('div', { class: 'field choice' }, label, select);
    // Where there is nothing to choose, nothing is asked.
    if (field.options.length === 1) for (const part of [label, select]) part.hidden = true;
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, { field, element, input: select });
    return element;
  }

  /** A tagged object: its kind is chosen, the fields of that kind follow. Kinds may share fields. */
  #buildVariant(field) {
    const element = this.#buildChoice(field, (kind) => this.#edit(field.pointer, keptBy(field, kind, this.#design), field.adjust));
    // What kinds share stands in the order of each of them.
    const placed = field.options.flatMap(({ fields }) => fields.map((inner, index) => ({ inner, index }))).sort((one, other) => one.index - other.index);
    for (const inner of new Map(placed.map((each) => [each.inner.pointer, each.inner])).values()) element.append(this.#buildField(inner));
    return element;
  }

  /** What the service does only where it is asked for it; left out, it is not. */
  #buildFlag(field) {
    const id = idOf(field.pointer, 'field');
    const input = html('input', { id, type: 'checkbox', 'aria-describedby': idOf(field.pointer, 'notes') });
    input.addEventListener('change', () => {
      const started = field.starts?.(this.#design, this.#answers) ?? true;
      this.#edit(field.pointer, input.checked ? started : undefined, field.adjust);
      this.#onEnd();
    });
    const element = html('div', { class: 'field flag' }, input, this.#named(field, html('label', { for: id }, field.label)));
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, { field, element, input });
    return element;
  }

  /** An object with exactly one of several fields, and perhaps others that stay. */
  #buildOneOf(field) {
    const element = this.#buildChoice(field, (key) => {
      const given = field.options.find((option) => at(this.#design, option.field.pointer) !== undefined);
      const option = field.options.find((candidate) => candidate.key === key);
      // What has no answer cannot be seen from the other side; it is asked for again rather than made up.
      const value = given && field.convert ? field.convert(given.key, at(this.#design, given.field.pointer), key, this.#answers, this.#design) : option.preset;
      this.#fields.get(field.pointer).chosen = key;
      const others = Object.entries(at(this.#design, field.pointer) ?? {}).filter(([name]) => !field.options.some((candidate) => candidate.key === name));
      const kept = value === undefined ? [] : [[key, typeof value === 'number' ? Number(value.toPrecision(12)) : value]];
      this.#edit(field.pointer, Object.fromEntries([...kept, ...others]), field.adjust);
    });
    for (const option of field.options) element.append(this.#buildField(option.field));
    return element;
  }

  #buildNumber(field) {
    const id = idOf(field.pointer, 'field');
    // A text, not a number: browsers read those each in their own way, and lose what they do not understand.
    const input = html('input', {
      id,
      type: 'text',
      class: 'number',
      inputmode: 'decimal',
      autocomplete: 'off',
      spellcheck: 'false',
      'aria-describedby': `${field.unit ? `${idOf(field.pointer, 'unit')} ` : ''}${idOf(field.pointer, 'notes')}`,
    });
    const label = html('label', { for: id }, field.of && html('span', { class: 'hidden' }, `${field.of}: `), field.label, field.symbol && [' ', symbol(field.symbol)]);
    const unit = html('span', { class: 'unit', id: idOf(field.pointer, 'unit') }, field.unit ?? '');
    const element = html('div', { class: 'field number-field' }, this.#named(field, label), html('span', { class: 'entry' }, input, unit));
    const entry = { field, element, input };
    if (field.slider) this.#addSlider(entry);
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, entry);
    input.addEventListener('input', () => {
      // What others follow from waits until it is whole: the first digit of a ratio is another one.
      entry.isEdited = true;
      if (!field.derived) this.#take(entry);
    });
    input.addEventListener('change', () => {
      if (field.derived) this.#take(entry);
      this.#onEnd();
      if (entry.fault === undefined) this.#showValue(entry);
    });
    input.addEventListener('keydown', (event) => {
      const sense = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!sense || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      this.#stepBy(entry, sense);
    });
    return element;
  }

  /** A list of objects with the same few numbers: one on each line, the numbers apart by spaces, units or not. */
  #buildLines(field) {
    const id = idOf(field.pointer, 'field');
    const order = field.columns.map(({ unit }) => unit).join(', ');
    const input = html('textarea', { id, class: 'number', rows: 3, spellcheck: 'false', autocomplete: 'off', 'aria-describedby': `${idOf(field.pointer, 'unit')} ${idOf(field.pointer, 'notes')}` });
    const unit = html('span', { class: 'unit', id: idOf(field.pointer, 'unit') }, order);
    const element = html('div', { class: 'field lines' }, this.#named(field, html('label', { for: id }, field.label)), unit, input);
    const entry = { field, element, input };
    this.#notesFor(field.pointer, element);
    this.#fields.set(field.pointer, entry);
    input.addEventListener('input', () => {
      const { value, fault } = linesRead(field, input.value, at(this.#design, field.pointer));
      entry.fault = fault;
      if (fault !== undefined) this.#renderNotes();
      else this.#edit(field.pointer, value, field.adjust);
    });
    input.addEventListener('change', () => this.#onEnd());
    return element;
  }

  /** Takes what was typed into the document, or says at the field why not. */
  #take(entry) {
    const { field, input } = entry;
    const { value, fault } = typed(input.value, field.unit);
    entry.fault = fault ?? (value === undefined ? undefined : field.refuses?.(value, this.#design));
    if (entry.fault !== undefined) this.#renderNotes();
    else if (field.derived) {
      entry.isEdited = false;
      if (value !== undefined) this.#replace(field.derived.write(this.#design, value), field.pointer);
    } else this.#edit(field.pointer, value, field.adjust);
  }

  #stepBy(entry, sense) {
    const { field, input } = entry;
    const { value } = typed(input.value, field.unit);
    if (value === undefined) return;
    const step = field.step ?? entry.step ?? (field.whole ? 1 : niceStep(Math.max(Math.abs(value), SPANNED.least) / 100));
    const next = field.next?.(value, sense) ?? rounded(value + sense * step, step);
    input.value = String(next);
    entry.isEdited = true;
    this.#take(entry);
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
      entry.fault = undefined;
      this.#edit(field.pointer, value);
    });
    entry.slider.addEventListener('pointerdown', () => {
      this.#held = entry;
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
  }

  /** Shows a document; sliders span anew around its values where `respan` says that it is another one. */
  setDesign(design, { respan = false } = {}) {
    if (!isSame(design, this.#design)) this.#told = undefined;
    this.#design = design;
    for (const entry of this.#fields.values()) this.#showValue(entry, respan);
    for (const { group, summary } of this.#groups) setText(summary, group.summary?.(design) ?? '');
  }

  /** Shows the option that is chosen; what no design like this one can have is not offered. */
  #offer({ field, input }, chosen) {
    field.options.forEach(({ value, suits }, index) => {
      setProperties(input.options[index], { hidden: value !== chosen && suits !== undefined && !suits(this.#design) });
    });
    setProperties(input, { value: String(chosen ?? '') });
  }

  #showValue(entry, respan) {
    const { field, input } = entry;
    const design = this.#design;
    if (field.kind === 'variant') {
      const kind = kindOf(field, design);
      this.#offer(entry, kind);
      const wanted = new Set(field.options.find(({ value }) => value === kind)?.fields.map(({ pointer }) => pointer));
      for (const { pointer } of field.options.flatMap(({ fields }) => fields)) setProperties(this.#fields.get(pointer).element, { hidden: !wanted.has(pointer) });
      return;
    }
    if (field.kind === 'oneOf') {
      const given = field.options.filter((option) => at(design, option.field.pointer) !== undefined);
      const shown = given.length > 0 ? given : [field.options.find(({ key }) => key === entry.chosen) ?? field.options[0]];
      setProperties(input, { value: shown[0].key });
      for (const option of field.options) setProperties(this.#fields.get(option.field.pointer).element, { hidden: !shown.includes(option) });
      return;
    }
    if (field.kind === 'flag') {
      input.checked = isOn(field, design);
      return;
    }
    if (field.kind === 'lines') {
      const isTyping = document.activeElement === input;
      if (!isTyping) entry.fault = undefined;
      if (!isTyping) setProperties(input, { value: linesOf(field, at(design, field.pointer)).join('\n') });
      return;
    }
    if (field.kind === 'choice') {
      this.#offer(entry, at(design, field.pointer) ?? field.otherwise?.(design) ?? field.options[0].value);
      return;
    }
    if (field.when) setProperties(entry.element, { hidden: !field.when(design) });
    const value = field.derived ? field.derived.read(design) : (at(design, field.pointer) ?? field.preset);
    const isTyping = document.activeElement === input;
    if (!isTyping) entry.fault = undefined;
    // What is being typed stays as it is spelled, as long as it means the value.
    const isShown = isTyping && (field.derived ? entry.isEdited : typed(input.value, field.unit).value === (at(design, field.pointer) ?? undefined));
    if (!isShown && entry.fault === undefined) setProperties(input, { value: typeof value === 'number' ? String(value) : '' });
    setProperties(input, { placeholder: String(field.optional?.(design, this.#answers) ?? field.preset ?? (field.derived ? '' : 'wanted')) });
    if (entry.slider) {
      const isGiven = typeof value === 'number' && value >= SPANNED.least && value <= SPANNED.most;
      setProperties(entry.slider.parentElement, { hidden: !isGiven });
      if (!isGiven) return;
      const { min, max } = entry.slider;
      if (respan || entry.step === undefined || value < Number(min) || value > Number(max)) this.#span(entry, value);
      else setProperties(entry.slider, { value: String(value) });
      setAttributes(entry.slider, { 'aria-valuetext': `${value} ${field.unit}` });
    }
  }

  /** Shows what the service says: the last answers that there are, why the document has none, findings. */
  setResult(answers, reasons, findings) {
    this.#answers = answers;
    this.reasons = reasons;
    this.#findings = findings;
    for (const entry of this.#fields.values()) {
      const { field } = entry;
      if (field.optional) setProperties(entry.input, { placeholder: String(field.optional(this.#design, answers)) });
      if (field.mark) this.#showMark(entry, field.mark(answers));
    }
    this.#renderNotes();
  }

  #showMark({ slider, mark, markText, field }, { value, text }) {
    setText(markText, value === undefined ? text : `${text} ${number(value, 4)} ${field.unit}`);
    const share = (value - Number(slider.min)) / (Number(slider.max) - Number(slider.min));
    setProperties(mark, { hidden: !(share >= 0 && share <= 1) });
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

  /** What a field without a value wants, where it has to have one. */
  #wantOf({ field, element, input }) {
    const isWanted = !field.kind || field.kind === 'number';
    if (!isWanted || field.optional || field.derived || field.preset !== undefined || element.hidden || input.value !== '') return undefined;
    const what = field.label[0].toLowerCase() + field.label.slice(1);
    return `Wanted here: the ${what}, ${field.whole ? 'a whole number' : `a number in ${field.unit}`}${field.likely === undefined ? '' : `, such as ${field.likely}`}.`;
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
    const say = (pointer, text) => add(pointer, 'problem', text, () => ({ element: html('p', { class: 'note problem' }, text) }));
    for (const [pointer, entry] of this.#fields) {
      const text = entry.fault ?? this.#wantOf(entry);
      if (text) say(pointer, text);
    }
    for (const reason of this.reasons ?? []) {
      const place = this.#placeOf(reason.pointer);
      // An empty field has said so itself.
      if (reason.code === 'missing_field' && place === reason.pointer && contents.get(place).length > 0) continue;
      add(place, 'problem', JSON.stringify(reason), () => ({ element: this.#problemNote(reason, place) }));
    }
    if (this.#told?.differences.length > 0) add(this.#placeOf(this.#told.pointer), 'info', JSON.stringify(this.#told), () => ({ element: this.#toldNote(this.#told) }));
    for (const finding of this.#findings) {
      for (const place of new Set(finding.pointers.map((pointer) => this.#placeOf(pointer)))) {
        add(place, finding.severity, finding.key, () => this.#findingNote(finding, place));
        built.get(`${place} ${finding.key}`).show(finding);
      }
    }
    for (const [pointer, entry] of this.#fields) {
      entry.element.dataset.state = worst.get(pointer) ?? '';
      if (worst.get(pointer) === 'problem') entry.input.setAttribute('aria-invalid', 'true');
      else entry.input.removeAttribute('aria-invalid');
    }
    // Colours follow at once; words, which take room, wait until the slider is let go.
    if (this.#held) return;
    this.#built = built;
    this.#inPlace(() => {
      for (const [pointer, notes] of contents) setChildren(this.#notes.get(pointer), notes.map((note) => note.element));
      for (const { group, details } of this.#groups) {
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

  /** What an edit changed beside its own field. */
  #toldNote({ pointer, differences }) {
    const list = differences.map(({ label, value, reference }) => `${label[0].toLowerCase()}${label.slice(1)} ${reference} → ${value}`).join(', ');
    const search = this.#fields.get(pointer)?.field.offersSearch && html('button', { type: 'button', class: 'link', onclick: () => this.onSearch(this.#design) }, 'Find a drive with this ratio');
    return html('p', { class: 'note info told-note' }, `Also changed: ${list}. `, search && ['Sizes stay as they are. ', search]);
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
    const remedy = html('div', {});
    const element = html('div', {}, button, remedy, panel);
    // The first field is the one to change first; the others only refer to the finding.
    const isMinor = this.#placeOf(pointers[0]) !== place;
    let shown;
    const show = (finding) => {
      if (isSame(finding, shown)) return;
      shown = finding;
      element.className = `note ${finding.severity}${isMinor ? ' minor' : ''}`;
      setChildren(remedy, isMinor ? [] : [this.remedyButton(finding)].filter(Boolean));
      panel.replaceChildren(explanation(finding, (pointer) => this.labelOf(pointer), (pointer) => this.goTo(pointer)));
    };
    return { element, show };
  }

  labelOf(pointer) {
    const place = this.#placeOf(pointer);
    const { field } = this.#fields.get(place) ?? {};
    const group = this.groups.find((candidate) => candidate.pointer === place);
    return field?.name ?? (field && fullLabel(field)) ?? group?.title ?? pointer;
  }

  /** Leads to a field: opens its group, moves the focus there. */
  goTo(pointer) {
    const place = this.#placeOf(pointer);
    const visible = [...this.#fields.entries()].find(([key, { element, input }]) => key.startsWith(place) && key.split('/').length > 2 && !element.hidden && !input.hidden);
    const { element, input } = this.#fields.get(place)?.field.kind === 'number' ? this.#fields.get(place) : (visible?.[1] ?? {});
    if (!element) return;
    element.closest('details').open = true;
    input.focus({ preventScroll: true });
    element.scrollIntoView({ block: 'center', behavior: 'auto' });
  }
}
