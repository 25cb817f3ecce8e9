// The drives that a search found: a plot of any two of their figures, the chosen one with its picture, a table, and two side by side.

import { Choice } from './ask.js';
import { axes, spread } from './chart.js';
import { at } from './design.js';
import { html, oncePerFrame, setText, svg } from './dom.js';
import { difference } from './format.js';
import { picture } from './picture.js';
import { limitInWords } from './reasons.js';
import { inputDifferences } from './report.js';
import { counted, labelled, t } from './texts.js';

const HEIGHT = 340;
/** Drives of one kind have one mark: `d` around the origin. */
const MARKS = ['M5 0A5 5 0 1 1 -5 0A5 5 0 1 1 5 0Z', 'M-4.5 -4.5H4.5V4.5H-4.5Z', 'M0 -6L5.5 4.5H-5.5Z', 'M0 -6.5L6 0L0 6.5L-6 0Z'];

const INPUTS = [
  { label: t('front.slots'), read: (design) => at(design, '/drive/teeth/count') },
  { label: t('label./drive/ring/teeth'), read: (design) => at(design, '/drive/ring/teeth') },
  { label: t('front.tooth_radius'), read: (design) => at(design, '/drive/teeth/radius_mm') },
];

const mark = (search) => ({ d: MARKS[search % MARKS.length], class: `mark-of mark-${search % MARKS.length}` });

export class Front {
  #front = [];
  #goals = [];
  #chosen = 0;
  /** Drives to compare, two at most. */
  #compared = [];
  #rows = [];

  /** `onOpen(found)` and `onOpenBoth(found, reference)` when a drive is taken as design. */
  constructor(container, { quantities, onOpen, onOpenBoth }) {
    Object.assign(this, { quantities, onOpen, onOpenBoth });
    this.title = html('h2', { id: 'front-title', tabindex: '-1' });
    this.xChoice = new Choice(t('front.across'), () => this.#draw());
    this.yChoice = new Choice(t('front.up'), () => this.#draw());
    this.chart = html('div', { class: 'study-chart', role: 'img', 'aria-label': t('front.chart') });
    this.key = html('ul', { class: 'key marks-key' });
    this.card = html('div', { class: 'drive-card' });
    this.figures = html('div', { class: 'drive-figures' });
    this.table = html('table', { class: 'drives' });
    this.comparison = html('section', { class: 'panel', 'aria-labelledby': 'comparison-title', hidden: true });
    this.panel = html(
      'section',
      { class: 'panel', 'aria-labelledby': 'front-title', hidden: true },
      html('header', {}, this.title, html('div', { class: 'ask-row' }, this.xChoice.element, this.yChoice.element)),
      html('div', { class: 'front' }, html('div', { class: 'drive-chart' }, this.chart, this.key), this.card, this.figures),
      html('div', { class: 'scroll drives-scroll', tabindex: '0', role: 'region', 'aria-label': t('front.table') }, this.table),
    );
    container.append(this.panel, this.comparison);
    this.chart.addEventListener('pointerdown', (event) => this.#pick(event));
    new ResizeObserver(oncePerFrame(() => this.#draw())).observe(this.chart);
  }

  /** The drives, and what counted; the chosen one stays where it is there still. */
  show(front, goals) {
    const isSameStill = (one, other) => one && other && JSON.stringify(one.design) === JSON.stringify(other.design);
    const before = this.#front[this.#chosen];
    const kept = this.#compared.map((index) => this.#front[index]);
    this.#front = front;
    this.#goals = goals;
    this.#chosen = Math.max(0, front.findIndex((found) => isSameStill(found, before)));
    this.#compared = kept.map((found) => front.findIndex((other) => isSameStill(found, other))).filter((index) => index >= 0);
    this.panel.hidden = front.length === 0;
    if (front.length === 0) {
      this.comparison.hidden = true;
      return;
    }
    setText(this.title, counted('front.drives', front.length));
    const names = Object.keys(front[0].quantities);
    const own = goals.map(({ quantity }) => quantity);
    const ordered = [...own, ...names.filter((name) => !own.includes(name))].filter((name) => !this.quantities.get(name).is_flag);
    const options = [{ options: ordered.map((name) => ({ value: name, label: this.quantities.get(name).label })) }];
    this.xChoice.offer(options, ordered[0]);
    this.yChoice.offer(options, ordered[1] ?? ordered[0]);
    const kinds = new Map(front.map(({ label, search }) => [search, label]));
    this.key.replaceChildren(...[...kinds].map(([search, label]) => html('li', {}, svg('svg', { viewBox: '-8 -8 16 16', width: 16, height: 16, 'aria-hidden': 'true' }, svg('path', mark(search))), label)));
    this.#build();
    this.#draw();
    this.#choose(this.#chosen);
    this.#compare();
  }

  #build() {
    const goals = this.#goals.map(({ quantity }) => quantity);
    const isMixed = new Set(this.#front.map(({ search }) => search)).size > 1;
    const head = [t('front.drive'), '', ...(isMixed ? [t('front.kind')] : []), ...goals.map((name) => this.quantities.headed(name)), ...INPUTS.map(({ label }) => label), t('front.compare')];
    this.#rows = this.#front.map((found, index) => {
      const name = html('button', { type: 'button', class: 'link', onclick: () => this.#choose(index) }, found.name);
      const check = html('input', { type: 'checkbox', 'aria-label': t('front.compare_it', { name: found.name.toLowerCase() }), onchange: () => this.#toggle(index) });
      const row = html(
        'tr',
        {},
        html('th', { scope: 'row' }, name),
        html('td', {}, picture(found.design)),
        isMixed && html('td', {}, found.label),
        goals.map((quantity) => html('td', { class: 'numeric number' }, this.quantities.bare(quantity, found.quantities[quantity]))),
        INPUTS.map(({ read }) => html('td', { class: 'numeric number' }, shortened(read(found.design)))),
        html('td', { class: 'numeric' }, check),
      );
      row.addEventListener('click', ({ target }) => target.closest('button, input') ?? this.#choose(index));
      return { row, name, check };
    });
    this.table.replaceChildren(
      html('thead', {}, html('tr', {}, head.map((text, index) => (text === '' ? html('td', {}) : html('th', { scope: 'col', class: index > (isMixed ? 2 : 1) && 'numeric' }, text))))),
      html('tbody', {}, this.#rows.map(({ row }) => row)),
    );
  }

  #draw() {
    if (this.#front.length === 0 || this.chart.clientWidth === 0) return;
    const width = Math.max(250, this.chart.clientWidth);
    const [xName, yName] = [this.xChoice.value, this.yChoice.value];
    const axis = (name) => ({ label: this.quantities.headed(name), ...spread(this.#front.map(({ quantities }) => quantities[name])) });
    this.frame = axes(width, Math.min(HEIGHT, 0.9 * width), axis(xName), axis(yName));
    this.points = this.#front.map(({ name, quantities, search }) => {
      const [x, y] = [this.frame.x(quantities[xName]), this.frame.y(quantities[yName])];
      return { x, y, element: svg('path', { ...mark(search), transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})` }, svg('title', {}, labelled(name, [xName, yName].map((each) => this.quantities.shown(each, quantities[each])).join(t('list.comma'))))) };
    });
    this.frame.plot.append(...this.points.map(({ element }) => element));
    this.chart.replaceChildren(this.frame.root);
    this.#mark();
  }

  #mark() {
    this.points?.forEach(({ element }, index) => {
      element.classList.toggle('chosen', index === this.#chosen);
      element.classList.toggle('compared', this.#compared.includes(index));
    });
    const chosen = this.points?.[this.#chosen];
    if (chosen) this.frame.plot.append(chosen.element);
    this.#rows.forEach(({ row, name, check }, index) => {
      row.classList.toggle('chosen', index === this.#chosen);
      name.setAttribute('aria-pressed', String(index === this.#chosen));
      check.checked = this.#compared.includes(index);
    });
  }

  /** The drive next to where the pointer is. */
  #pick(event) {
    const bounds = this.chart.getBoundingClientRect();
    const distance = ({ x, y }) => Math.hypot(event.clientX - bounds.left - x, event.clientY - bounds.top - y);
    if (this.points?.length > 0) this.#choose(this.points.reduce((best, point, index, all) => (distance(point) < distance(all[best]) ? index : best), 0));
  }

  #choose(index) {
    this.#chosen = index;
    const found = this.#front[index];
    const figures = Object.entries(found.quantities).map(([name, value]) => html('div', {}, html('dt', {}, this.quantities.get(name).label), html('dd', { class: 'number' }, this.quantities.shown(name, value))));
    const isCompared = this.#compared.includes(index);
    if (this.pictured !== found.design) {
      this.pictured = found.design;
      this.cardPicture = picture(found.design, { isLarge: true });
    }
    this.card.replaceChildren(
      this.cardPicture,
      html('h3', {}, found.name),
      html('p', { class: 'none' }, found.label),
      html('p', {}, found.heldBy.length > 0 ? t('front.close', { limits: found.heldBy.map((limit) => limitInWords(limit, this.quantities, { isWithin: true })).join(t('list.semicolon')) }) : t('front.not_close')),
      html(
        'div',
        { class: 'actions' },
        html('button', { type: 'button', class: 'primary', onclick: () => this.onOpen(found) }, t('front.open')),
        html('button', { type: 'button', 'aria-pressed': String(isCompared), onclick: () => this.#toggle(index) }, t('front.compare')),
      ),
    );
    this.figures.replaceChildren(html('h3', {}, t('front.figures_of', { name: found.name })), html('dl', { class: 'figures' }, figures));
    this.#mark();
  }

  /** Of three the one that was taken first gives way. */
  #toggle(index) {
    this.#compared = this.#compared.includes(index) ? this.#compared.filter((other) => other !== index) : [...this.#compared.slice(-1), index];
    this.#choose(this.#chosen);
    this.#compare();
  }

  #compare() {
    const [one, other] = this.#compared.map((index) => this.#front[index]);
    this.comparison.hidden = one === undefined;
    if (!one) return;
    const title = html('h2', { id: 'comparison-title' }, other ? t('front.pair', { one: one.name, other: other.name.toLowerCase() }) : t('front.and_another', { one: one.name }));
    if (!other) {
      this.comparison.replaceChildren(html('header', {}, title), html('p', { class: 'none' }, t('front.choose_another')));
      return;
    }
    // At one scale: as large as the larger of the two.
    const halfMm = Math.max(...[one, other].map(({ quantities }) => quantities.outer_diameter_mm)) / 2;
    const rows = Object.keys(one.quantities).map((name) => {
      const values = [one, other].map(({ quantities }) => quantities[name]);
      return [this.quantities.get(name).label, ...values.map((value) => this.quantities.shown(name, value)), this.quantities.get(name).is_flag ? '' : difference(values[1], values[0])];
    });
    const inputs = inputDifferences(...[one, other].map(({ design }) => legible(design))).map(({ label, value, reference }) => [label, value, reference, '']);
    const body = (title, lines) => html('tbody', {}, html('tr', { class: 'group' }, html('th', { scope: 'colgroup', colspan: 4 }, title)), lines.map(([label, ...cells]) => html('tr', {}, html('th', { scope: 'row' }, label), cells.map((text) => html('td', { class: 'numeric number' }, text)))));
    this.comparison.replaceChildren(
      html('header', {}, title, html('button', { type: 'button', onclick: () => this.onOpenBoth(other, one) }, t('front.open_both', { other: other.name.toLowerCase(), one: one.name.toLowerCase() }))),
      html('div', { class: 'pair' }, [one, other].map((found) => html('figure', {}, picture(found.design, { isLarge: true, halfMm }), html('figcaption', {}, labelled(found.name, found.label))))),
      html(
        'div',
        { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': t('front.comparison') },
        html('table', { class: 'drives' }, html('thead', {}, html('tr', {}, html('td', {}), [one.name, other.name, t('comparison.difference')].map((text) => html('th', { scope: 'col', class: 'numeric' }, text)))), body(t('front.figures'), rows), body(t('front.inputs'), inputs)),
      ),
    );
  }
}

/** A document with the digits of its numbers that can be read. */
const legible = (value) => {
  if (typeof value === 'number') return Number(value.toPrecision(5));
  return value !== null && typeof value === 'object' ? Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, legible(inner)])) : value;
};

const shortened = (value) => (typeof value === 'number' ? String(Number(value.toPrecision(4))) : '–');
