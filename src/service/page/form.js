// The form, built from a table of fields, with problems and findings at the fields that they point at.

import { at, changed, isSame } from './design.js';
import { explanationOf, fullLabel, isOn, keptBy, kindOf } from './field.js';
import { FieldNotes, idOf } from './field-notes.js';
import { GROUPS } from './fields.js';
import { linesOf, linesRead } from './lines.js';
import { html, setProperties, setText, symbol } from './dom.js';
import { number, typed } from './format.js';
import { knownMaterials, materialsOf, titleOf } from './materials.js';
import { remedyOf } from './remedies.js';
import { inputDifferences } from './report.js';
import { Slider, niceStep, rounded } from './slider.js';
import { TERMS, explained } from './terms.js';
import { labelled, t } from './texts.js';

const sourceOf = ({ elasticity_source: source, allowable_stress_mpa: allowable, allowable_stress_source: stress_source }) =>
  allowable === undefined ? t('form.no_allowable', { source }) : t('form.allowable', { source, stress: number(allowable), stress_source });

export class Form {
  #fields = new Map();
  #groups = [];
  /** Whether a slider is held: as long as it is, nothing moves under the pointer. */
  #held = false;
  #onEdit;
  #onEnd;
  #design = {};
  #answers = {};
  #fillings = [];

  /** `onEdit(design, gesture)` at each change; changes of one gesture are one step to undo; `onEnd()` ends it; `onRemedy(finding)` comes before its
   *  remedy; `onSearch(design)` looks for a drive like it. All fields stand below the pointer `root`. */
  constructor(container, { onEdit, onEnd, onRemedy, onSearch }, groups = GROUPS, root = '') {
    this.container = container;
    this.#onEdit = onEdit;
    this.#onEnd = onEnd;
    this.onRemedy = onRemedy;
    this.notes = new FieldNotes(container, this.#fields, this.#groups, {
      isHeld: () => this.isHeld,
      fix: (pointer, value) => this.#fix(pointer, value),
      keepOnly: (place, field) => this.#keepOnly(place, field),
      search: () => onSearch(this.#design),
      remedyButton: (finding) => this.remedyButton(finding),
    });
    const general = this.notes.add(root, container);
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
    return this.#held;
  }

  #release() {
    if (!this.#held) return;
    this.#held = false;
    this.notes.show();
    this.#onEnd();
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
    if (!(group.fields ?? []).some((field) => field.pointer === group.pointer)) this.notes.add(group.pointer, details);
    for (const part of group.parts ?? [group]) {
      const set = html('div', { class: 'set', role: 'group', 'aria-label': part.title });
      if (group.parts) set.append(html('h4', {}, part.title), part.hint ? html('p', { class: 'hint' }, part.hint) : '');
      if (part.part) set.append(this.#buildFilling(part));
      for (const field of part.fields) set.append(this.#buildField(field));
      details.append(set);
    }
    const told = group.told && html('p', { class: 'hint told' });
    if (told) details.append(told);
    this.#groups.push({ group, details, summary, told });
    return details;
  }

  /** What fills in a part's numbers by name; it is hidden until there are names. */
  #buildFilling({ part, title }) {
    const select = html('select', { 'aria-label': t('form.material', { part: title }) });
    const source = html('p', { class: 'hint' });
    const element = html('div', { class: 'filling', hidden: true }, select, source);
    const filling = { part, element, select, source, chosen: '' };
    select.addEventListener('change', () => {
      filling.chosen = select.value;
      const { youngs_modulus_gpa, poissons_ratio } = knownMaterials().find(({ name }) => name === select.value);
      this.#edit(`/materials/${part}`, { youngs_modulus_gpa, poissons_ratio });
      this.setDesign(this.#design);
      this.#onEnd();
    });
    this.#fillings.push(filling);
    return element;
  }

  /** Offers the known materials by name. */
  offerMaterials() {
    for (const { element, select } of this.#fillings) {
      select.replaceChildren(html('option', { value: '', disabled: true }, t('form.fill_in')), ...knownMaterials().map(({ name, title }) => html('option', { value: name }, title)));
      element.hidden = knownMaterials().length === 0;
    }
    for (const filling of this.#fillings) this.#showFilling(filling);
  }

  /** The material that has a part's numbers; of several that share them the one that was chosen. */
  #showFilling({ part, chosen, select, source }) {
    const found = materialsOf(this.#design, part);
    const material = found.find(({ name }) => name === chosen) ?? (found.length === 1 ? found[0] : undefined);
    setProperties(select, { value: material?.name ?? '' });
    setText(source, material ? sourceOf(material) : titleOf(found));
  }

  #buildField(field) {
    if (field.kind === 'choice') return this.#buildChoice(field, (chosen) => this.#choose(field, chosen));
    if (field.kind === 'variant') return this.#buildVariant(field);
    if (field.kind === 'oneOf') return this.#buildOneOf(field);
    if (field.kind === 'flag') return this.#buildFlag(field);
    if (field.kind === 'lines') return this.#buildLines(field);
    return this.#buildNumber(field);
  }

  /** `adjust` changes what follows from it, perhaps from the design and the answers before. */
  #edit(pointer, value, adjust = (design) => design) {
    this.#replace(adjust(changed(this.#design, pointer, value), this.#design, this.#answers), pointer);
  }

  /** The document's value may be none, or no text. */
  #choose({ pointer, options, adjust }, chosen) {
    const { value } = options.find((option) => String(option.value) === chosen);
    this.#edit(pointer, value === '' ? undefined : value, adjust);
  }

  /** Takes another document, and tells what changes beside the field that was edited. */
  #replace(design, pointer) {
    const isOwn = (other) => other === pointer || other.startsWith(`${pointer}/`);
    this.notes.told = { pointer, differences: inputDifferences(design, this.#design).filter(({ pointer: other }) => !isOwn(other)) };
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
      this.onRemedy(finding);
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
    this.notes.add(field.pointer, element);
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
    this.notes.add(field.pointer, element);
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
    const label = html('label', { for: id }, field.of && html('span', { class: 'hidden' }, labelled(field.of, '')), field.label, field.symbol && [' ', symbol(field.symbol)]);
    const unit = html('span', { class: 'unit', id: idOf(field.pointer, 'unit') }, field.unit ?? '');
    const element = html('div', { class: 'field number-field' }, this.#named(field, label), html('span', { class: 'entry' }, input, unit));
    const entry = { field, element, input };
    if (field.slider) entry.slider = this.#buildSlider(entry);
    this.notes.add(field.pointer, element);
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
    this.notes.add(field.pointer, element);
    this.#fields.set(field.pointer, entry);
    input.addEventListener('input', () => {
      const { value, fault } = linesRead(field, input.value, at(this.#design, field.pointer));
      entry.fault = fault;
      if (fault !== undefined) this.notes.show();
      else this.#edit(field.pointer, value, field.adjust);
    });
    input.addEventListener('change', () => this.#onEnd());
    return element;
  }

  #buildSlider(entry) {
    const { field, element } = entry;
    const slider = new Slider(field, {
      onInput: (value) => {
        entry.input.value = String(value);
        entry.fault = undefined;
        this.#edit(field.pointer, value);
      },
      onHold: () => {
        this.#held = true;
      },
      onEnd: () => this.#onEnd(),
    });
    element.append(...slider.elements);
    return slider;
  }

  /** Takes what was typed into the document, or says at the field why not. */
  #take(entry) {
    const { field, input } = entry;
    const { value, fault } = typed(input.value, field.unit);
    entry.fault = fault ?? (value === undefined ? undefined : field.refuses?.(value, this.#design));
    if (entry.fault !== undefined) this.notes.show();
    else if (field.derived) {
      entry.isEdited = false;
      if (value !== undefined) this.#replace(field.derived.write(this.#design, value), field.pointer);
    } else this.#edit(field.pointer, value, field.adjust);
  }

  #stepBy(entry, sense) {
    const { field, input } = entry;
    const { value } = typed(input.value, field.unit);
    if (value === undefined) return;
    const step = field.step ?? entry.slider?.step ?? (field.whole ? 1 : niceStep(value));
    const next = field.next?.(value, sense) ?? rounded(value + sense * step, step);
    input.value = String(next);
    entry.isEdited = true;
    this.#take(entry);
  }

  /** Shows a document; where `respan` says that it is another one, sliders span anew around its values and chosen materials are forgotten. */
  setDesign(design, { respan = false } = {}) {
    if (!isSame(design, this.#design)) this.notes.told = undefined;
    this.#design = design;
    for (const entry of this.#fields.values()) this.#showValue(entry, respan);
    for (const { group, summary, told } of this.#groups) {
      setText(summary, group.summary?.(design, group) ?? '');
      if (told) setText(told, group.told(design));
    }
    for (const filling of this.#fillings) {
      if (respan) filling.chosen = '';
      this.#showFilling(filling);
    }
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
    setProperties(input, { placeholder: String(field.optional?.(design, this.#answers) ?? field.preset ?? (field.derived ? '' : t('empty.wanted'))) });
    entry.slider?.show(value, respan);
  }

  /** Shows what the service says: the last answers that there are, why the document has none, findings. */
  setResult(answers, reasons, findings) {
    this.#answers = answers;
    Object.assign(this.notes, { reasons, findings });
    for (const entry of this.#fields.values()) {
      const { field } = entry;
      if (field.optional) setProperties(entry.input, { placeholder: String(field.optional(this.#design, answers)) });
      if (field.mark) entry.slider.showMark(field.mark(answers));
    }
    this.notes.show();
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

  labelOf(pointer) {
    return this.notes.labelOf(pointer);
  }

  goTo(pointer) {
    this.notes.goTo(pointer);
  }
}
