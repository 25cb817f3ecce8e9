// What each number of the design does to a quantity: a ranking, what moves it most first.

import { Choice, NumberBox } from './ask.js';
import { html, setText } from './dom.js';
import { DASH, difference, number, withUnit } from './format.js';
import { wordsOf } from './parameters.js';
import { StudyView } from './study-view.js';
import { counted, labelled, t } from './texts.js';
import { detailOf, sentence } from './words.js';

const FIRST_QUANTITY = 'peak_stress_mpa';
/** How far a number is moved where nobody says otherwise. */
const RELATIVE = 0.01;
const MOST_AT_ONCE = 10_000;

export class Sensitivity extends StudyView {
  #answer;
  /** How far numbers are moved instead, by pointer. */
  #plusMinus = new Map();
  #pointers = [];

  constructor(section, { quantities, goTo }) {
    super({ mostAtOnce: MOST_AT_ONCE, verb: t('sensitivity.look_again') });
    this.quantities = quantities;
    this.goTo = goTo;
    this.quantity = new Choice(t('study.quantity'), () => this.#show());
    this.value = html('p', { class: 'headline' });
    this.table = html('table', { class: 'drives tornado' });
    this.reasons = html('ul', { class: 'plain' });
    this.reset = html('button', { type: 'button', class: 'link', hidden: true, onclick: () => this.#reset() }, t('sensitivity.reset'));
    section.append(
      html('header', {}, html('h2', { id: 'sensitivity-title', tabindex: '-1' }, t('view.sensitivity'))),
      html('p', { class: 'none' }, t('sensitivity.intro')),
      html('div', { class: 'ask' }, html('div', { class: 'ask-row' }, this.quantity.element, this.reset)),
      this.progress.element,
      this.state,
      this.value,
      html('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': t('sensitivity.ranking') }, this.table),
      this.reasons,
    );
  }

  offer() {
    this.quantity.offer(
      this.quantities.groupsFor(this.design).map(({ title, quantities }) => ({ title, options: quantities.filter(({ is_flag: isFlag }) => !isFlag).map(({ name, label }) => ({ value: name, label })) })),
      FIRST_QUANTITY,
    );
  }

  ask() {
    // Those that are not known yet the service chooses; as soon as one is moved otherwise, all are named.
    const inputs =
      this.#plusMinus.size === 0
        ? {}
        : Object.fromEntries(this.#pointers.map((pointer) => [pointer, this.#plusMinus.has(pointer) ? { plus_minus: this.#plusMinus.get(pointer) } : { relative: RELATIVE }]));
    return { question: { study: 'sensitivity', base: this.design, inputs, quantities: [] }, variants: 0 };
  }

  take(answer) {
    this.#answer = answer;
    if (this.#plusMinus.size === 0) this.#pointers = (answer.quantities[0]?.inputs ?? []).map(({ pointer }) => pointer);
    this.#show();
  }

  #reset() {
    this.#plusMinus.clear();
    this.later(0);
  }

  #show() {
    const of = this.#answer?.quantities.find(({ quantity }) => quantity === this.quantity.value);
    this.reset.hidden = this.#plusMinus.size === 0;
    this.table.hidden = !of;
    this.reasons.replaceChildren(...(this.#answer?.reasons ?? []).map(({ variants, ...reason }) => html('li', {}, labelled(counted('sensitivity.no_answer', variants), sentence(detailOf(reason))))));
    if (!of) {
      setText(this.value, this.#answer ? t('sensitivity.no_design') : '');
      return;
    }
    const { quantity, value, inputs } = of;
    setText(this.value, labelled(this.quantities.get(quantity).label, this.quantities.shown(quantity, value)));
    const most = Math.max(...inputs.map(({ change }) => change), Number.MIN_VALUE);
    const head = [t('comparison.input'), t('sensitivity.moved'), t('sensitivity.less'), t('sensitivity.more'), t('sensitivity.change')];
    this.table.replaceChildren(
      html('thead', {}, html('tr', {}, head.map((text, index) => html('th', { scope: 'col', class: index > 0 && index < 4 && 'numeric' }, text)))),
      html('tbody', {}, inputs.map((input) => this.#row(input, value, most))),
    );
  }

  #row({ pointer, value: given, plus_minus: plusMinus, at_minus: less, at_plus: more, is_smooth: isSmooth }, value, most) {
    const { label, unit } = wordsOf(pointer);
    const box = new NumberBox(labelled(label, unit ? t('sensitivity.moved_by_unit', { unit }) : t('sensitivity.moved_by')), () => {
      if (box.fault === undefined && box.value > 0) this.#plusMinus.set(pointer, box.value);
      else this.#plusMinus.delete(pointer);
      this.later(0);
    });
    box.unit = unit;
    box.value = Number(plusMinus.toPrecision(4));
    box.input.classList.add('cell-input');
    const bar = (end, kind) => {
      if (end === undefined || end === value) return undefined;
      const part = html('span', { class: `part-of ${kind}` });
      const share = (end - value) / most / 2;
      part.style.left = `${100 * (0.5 + Math.min(0, share))}%`;
      part.style.width = `${100 * Math.abs(share)}%`;
      return part;
    };
    const cell = (end) => html('td', { class: 'numeric number' }, end === undefined ? t('sensitivity.none') : difference(end, value));
    // Where one way has no answer its cell says so.
    const isUnlike = !isSmooth && less !== undefined && more !== undefined;
    const words = [label, ' ', html('span', { class: 'unit' }, withUnit(number(given), unit)), isUnlike ? html('span', { class: 'unit' }, t('sensitivity.unlike')) : ''];
    return html(
      'tr',
      {},
      html('th', { scope: 'row' }, html('button', { type: 'button', class: 'link', onclick: () => this.goTo(pointer) }, words)),
      html('td', { class: 'numeric' }, box.input, html('span', { class: 'unit' }, ` ${unit}`)),
      cell(less),
      cell(more),
      html('td', {}, html('span', { class: 'tornado-bar', 'aria-hidden': 'true' }, bar(less, 'less'), bar(more, 'more'), less === undefined && more === undefined ? DASH : undefined)),
    );
  }
}
