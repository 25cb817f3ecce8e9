// What studies are asked with: choices and numbers in a row.

import { html } from './dom.js';
import { typed } from './format.js';
import { t } from './texts.js';
import { sentence } from './words.js';

/** A choice: `groups` are `{ title, options: [{ value, label }] }`. What was chosen stays as long as it is there. */
export class Choice {
  constructor(label, onChange) {
    this.select = html('select', { onchange: () => onChange(this.value) });
    this.element = html('label', { class: 'inline' }, html('span', {}, label), this.select);
  }

  get value() {
    return this.select.value;
  }

  set value(value) {
    this.select.value = value;
  }

  get label() {
    return this.select.selectedOptions[0]?.textContent ?? '';
  }

  /** `preferred` is chosen where what was is there no more. */
  offer(groups, preferred) {
    const text = JSON.stringify(groups);
    if (text === this.offered) return;
    this.offered = text;
    const before = this.value;
    const option = ({ value, label }) => html('option', { value }, label);
    this.select.replaceChildren(
      ...groups.flatMap(({ title, options }) => (title === undefined ? options.map(option) : [html('optgroup', { label: title }, options.map(option))])),
    );
    const all = groups.flatMap(({ options }) => options.map(({ value }) => value));
    this.value = [before, preferred].find((value) => all.includes(value)) ?? all[0] ?? '';
  }
}

/** A number as somebody types it; `value` is undefined where there is none. */
export class NumberBox {
  #fault;
  unit = '';

  constructor(label, onChange) {
    this.input = html('input', { type: 'text', class: 'number', inputmode: 'decimal', autocomplete: 'off', spellcheck: 'false', 'aria-label': label });
    this.input.addEventListener('change', () => {
      this.#fault = typed(this.input.value, this.unit).fault;
      if (this.#fault) this.input.setAttribute('aria-invalid', 'true');
      else this.input.removeAttribute('aria-invalid');
      onChange();
    });
  }

  get value() {
    return typed(this.input.value, this.unit).value;
  }

  set value(value) {
    this.input.value = value === undefined ? '' : String(value);
    this.input.removeAttribute('aria-invalid');
    this.#fault = undefined;
  }

  /** Why what stands there is no number. */
  get fault() {
    return this.#fault;
  }
}

/** Where a study stands: a bar, words and a button to cancel it. */
export class Progress {
  constructor(onCancel) {
    this.bar = html('progress', { max: 1, 'aria-label': t('study.progress') });
    this.words = html('span', { class: 'number' });
    this.cancel = html('button', { type: 'button', onclick: onCancel }, t('study.cancel'));
    this.element = html('div', { class: 'study-progress', hidden: true }, this.bar, this.words, this.cancel);
  }

  /** `share` undefined where it is not known. */
  show(words, share) {
    this.element.hidden = false;
    if (share === undefined) this.bar.removeAttribute('value');
    else this.bar.value = share;
    if (this.words.textContent !== words) this.words.textContent = words;
  }

  hide() {
    this.element.hidden = true;
  }
}

/** What keeps a study from being carried out, in words. */
export function problemNote({ title, detail, errors = [] }) {
  const words = errors.length > 0 ? errors.map((error) => error.detail) : [detail];
  return html('div', { class: 'note problem' }, html('strong', {}, sentence(title)), html('ul', {}, words.map((text) => html('li', {}, sentence(text)))));
}
