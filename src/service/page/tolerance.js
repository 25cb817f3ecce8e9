// What parts as they are made do to a quantity: drives with deviations by chance, their spread, how many are good, and what does most.

import { Choice, NumberBox } from './ask.js';
import { axes } from './chart.js';
import { at, changed, compatibilityOf } from './design.js';
import { html, oncePerFrame, setText, svg } from './dom.js';
import { number } from './format.js';
import { GRADE_NAMES, toleranceUm } from './grades.js';
import { wordsOf } from './parameters.js';
import { StudyView } from './study-view.js';
import { labelled, parts, t } from './texts.js';
import { detailOf, sentence } from './words.js';

const FIRST_QUANTITY = 'transmission_error_peak_to_peak_deg';
const MOST_AT_ONCE = 2000;
const HEIGHT = 250;

const DEVIATIONS = [
  { name: 'tooth_radius_um', label: t('tolerance.deviation.tooth_radius_um'), unit: 'µm', limit: 2, grade: 'IT6', middle: '/modification/tooth_radius_um' },
  { name: 'slot_angle_arcsec', label: t('tolerance.deviation.slot_angle_arcsec'), unit: '″', limit: 20 },
  { name: 'slot_wall_um', label: t('tolerance.deviation.slot_wall_um'), unit: 'µm', limit: 3, grade: 'IT7', middle: '/modification/slot_wall_um' },
  { name: 'ring_space_um', label: t('tolerance.deviation.ring_space_um'), unit: 'µm', limit: 5, grade: 'IT7', middle: '/modification/ring_equidistant_um' },
  { name: 'ring_space_angle_arcsec', label: t('tolerance.deviation.ring_space_angle_arcsec'), unit: '″', limit: 20 },
  { name: 'wave_generator_lobe_um', label: t('tolerance.deviation.wave_generator_lobe_um'), unit: 'µm', limit: 5 },
  { name: 'wave_generator_runout', label: t('tolerance.deviation.wave_generator_runout'), unit: 'µm', limit: 5 },
  { name: 'ring_runout', label: t('tolerance.deviation.ring_runout'), unit: 'µm', limit: 5 },
  { name: 'carrier_runout', label: t('tolerance.deviation.carrier_runout'), unit: 'µm', limit: 5 },
];
/** What stands in the document and deviates in a whole drive. */
const INPUTS = [
  { name: '/drive/teeth/radius_mm', label: t('tolerance.all_radii'), unit: 'mm', limit: 0.005 },
  { name: '/drive/teeth/width_mm', label: t('tolerance.all_widths'), unit: 'mm', limit: 0.05 },
];

/** A limit is three standard deviations of the normal distribution that it cuts off. */
const SIGMAS = 3;

const DISTRIBUTIONS = [
  { value: 'none', label: t('tolerance.exact') },
  { value: 'normal', label: t('tolerance.normal') },
  { value: 'uniform', label: t('tolerance.uniform') },
];
const GRADED = [{ options: DISTRIBUTIONS }, { title: t('tolerance.iso'), options: GRADE_NAMES.map((grade) => ({ value: grade, label: grade })) }];

/** Half of the zone of a grade: a tolerance of a tooth's, slot's or space's width is two times that of its radius or wall. */
const halfZoneUm = (grade, design) => toleranceUm(grade, 2 * at(design, '/drive/teeth/radius_mm')) / 4;

export class Tolerance extends StudyView {
  #result;

  constructor(section, { quantities }) {
    super({ mostAtOnce: MOST_AT_ONCE, verb: t('tolerance.draw') });
    this.quantities = quantities;
    const onChange = () => this.later();
    this.quantity = new Choice(t('study.quantity'), onChange);
    this.samples = new Choice(t('tolerance.drives'), onChange);
    this.samples.offer([{ options: [100, 1000, 10_000, 100_000].map((count) => ({ value: String(count), label: number(count, 9) })) }], '100');
    this.samples.value = '100';
    this.ends = [t('tolerance.good_at_least'), t('tolerance.good_at_most')].map((words) => new NumberBox(words, onChange));
    this.unit = html('span', { class: 'unit' });
    this.rows = [...DEVIATIONS.map((kind) => ({ ...kind, list: 'deviations' })), ...INPUTS.map((kind) => ({ ...kind, list: 'inputs' }))].map((kind) => {
      const distribution = new Choice(kind.label, onChange);
      distribution.offer(kind.grade ? GRADED : [{ options: DISTRIBUTIONS }], kind.grade ?? 'none');
      if (kind.grade) distribution.value = kind.grade;
      const limit = new NumberBox(labelled(kind.label, t('tolerance.plus_minus', { unit: kind.unit })), onChange);
      limit.value = kind.limit;
      limit.unit = kind.unit;
      const range = html('span', { class: 'range' }, '± ', limit.input, html('span', { class: 'unit' }, kind.unit));
      const zone = html('span', { class: 'range' });
      return { ...kind, distribution, limit, range, zone, element: html('div', { class: 'ask-row deviation' }, distribution.element, range, zone) };
    });
    this.value = html('p', { class: 'headline' });
    this.chart = html('div', { class: 'study-chart', role: 'img', 'aria-label': t('tolerance.chart') });
    this.tables = html('div', { class: 'tolerance-tables' });
    section.append(
      html('header', {}, html('h2', { id: 'tolerance-title', tabindex: '-1' }, t('view.tolerance'))),
      html('p', { class: 'none' }, t('tolerance.intro')),
      html('div', { class: 'ask' }, html('div', { class: 'ask-row' }, this.quantity.element, this.samples.element, this.button), html('div', { class: 'ask-row' }, html('span', { class: 'range' }, parts('tolerance.good', { from: this.ends[0].input, to: this.ends[1].input }), ' ', this.unit))),
      html('details', { class: 'deviations', open: true }, html('summary', {}, t('tolerance.deviations')), this.rows.map(({ element }) => element)),
      this.progress.element,
      this.state,
      this.value,
      this.chart,
      this.tables,
    );
    new ResizeObserver(oncePerFrame(() => this.isShown && this.#draw())).observe(this.chart);
  }

  offer() {
    this.quantity.offer(
      this.quantities.groupsFor(this.design).map(({ title, quantities }) => ({ title, options: quantities.filter(({ is_flag: isFlag }) => !isFlag).map(({ name, label }) => ({ value: name, label })) })),
      FIRST_QUANTITY,
    );
    const { unit } = this.quantities.get(this.quantity.value);
    setText(this.unit, unit);
    for (const end of this.ends) end.unit = unit;
    for (const { list, name, element, distribution, range, zone } of this.rows) {
      const { value } = distribution;
      const isGraded = GRADE_NAMES.includes(value);
      element.hidden = list === 'inputs' && typeof at(this.design, name) !== 'number';
      range.hidden = value === 'none' || isGraded;
      setText(zone, isGraded ? t('tolerance.zone', { width: number(2 * halfZoneUm(value, this.design)) }) : '');
    }
  }

  ask() {
    const lists = { deviations: {}, inputs: {} };
    let base = changed(this.design, '/deviations', undefined);
    for (const { list, name, distribution, limit, label, element, middle } of this.rows) {
      if (distribution.value === 'none' || element.hidden) continue;
      if (GRADE_NAMES.includes(distribution.value)) {
        // The zone lies beside the nominal size: its middle is a modification, and parts deviate around that.
        const half = halfZoneUm(distribution.value, this.design);
        base = changed(base, middle, (at(base, middle) ?? 0) + half);
        lists.deviations[name] = { distribution: 'normal', limit: half, sigma: half / SIGMAS };
        continue;
      }
      const fault = limit.fault ?? (limit.value > 0 ? undefined : labelled(label, t('tolerance.fault.limit')));
      if (fault) return { fault };
      lists[list][name] = { distribution: distribution.value, limit: limit.value, ...(distribution.value === 'normal' ? { sigma: limit.value / SIGMAS } : {}) };
    }
    const kinds = Object.keys(lists.deviations).length + Object.keys(lists.inputs).length;
    if (kinds === 0) return { fault: t('tolerance.fault.nothing') };
    if (Object.keys(lists.deviations).length > 0 && compatibilityOf(this.design) === 'projection') {
      return { fault: t('tolerance.fault.projection') };
    }
    const fault = this.ends.map((end) => end.fault).find((text) => text !== undefined);
    if (fault) return { fault };
    const [min, max] = this.ends.map(({ value }) => value);
    if (min > max) return { fault: t('tolerance.fault.empty') };
    const name = this.quantity.value;
    const require = min === undefined && max === undefined ? {} : { [name]: { ...(min === undefined ? {} : { min }), ...(max === undefined ? {} : { max }) } };
    const samples = Number(this.samples.value);
    return { question: { study: 'tolerance', base, ...lists, quantities: [name], require, samples }, variants: samples, name, isSlow: Object.keys(lists.deviations).length > 0 };
  }

  take(answer, { name, question }) {
    const of = answer.quantities.find(({ quantity }) => quantity === name);
    this.#result = { answer, of, name, require: question.require[name] ?? {} };
    const { yield: share, interference, impossible, samples } = answer;
    const percent = (value) => `${number(100 * value, 4)}\u202f%`;
    const clashes = { count: number(interference, 9), all: number(samples, 9) };
    const said = [
      share && t('tolerance.good_share', { share: percent(share.share), low: percent(share.low), high: percent(share.high) }),
      interference > 0 && (2 * interference > samples ? t('tolerance.interference_often', clashes) : t('tolerance.interference', clashes)),
      impossible > 0 && t('tolerance.impossible', { count: number(impossible, 9) }),
    ].filter(Boolean);
    const spread = of && t('tolerance.spread', { all: number(samples, 9), low: this.#level(of.quantiles[0].value), high: this.#level(of.quantiles.at(-1).value) });
    setText(this.value, said.length > 0 ? said.join(' ') : (spread ?? ''));
    this.#showTables();
    this.#draw();
  }

  /** A value of the quantity with digits enough to tell drives of this spread apart. */
  #level(value) {
    const { of, name } = this.#result;
    const spread = of.quantiles.at(-1).value - of.quantiles[0].value;
    const size = Math.max(...of.quantiles.map((quantile) => Math.abs(quantile.value)));
    const apart = spread > 0 ? Math.ceil(Math.log10(size / spread)) + 2 : 0;
    return this.quantities.shown(name, value, Math.min(9, Math.max(5, apart)), Math.min(9, Math.max(3, apart)));
  }

  #showTables() {
    const { answer, of, name } = this.#result;
    const level = (value) => (value === undefined ? '–' : this.#level(value));
    const shown = (value) => (value === undefined ? '–' : this.quantities.shown(name, value, 5));
    const table = (title, head, rows) =>
      html('div', {}, html('h3', {}, title), html('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': title }, html('table', { class: 'drives' }, html('thead', {}, html('tr', {}, head.map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text)))), html('tbody', {}, rows))));
    const row = (title, ...cells) => html('tr', {}, html('th', { scope: 'row' }, title), cells.map((text) => html('td', { class: 'numeric number' }, text)));
    const tables = [];
    if (of) {
      const rows = of.quantiles.map(({ share, value, low, high }) => row(`${number(100 * share, 4)}\u202f%`, level(value), low === undefined && high === undefined ? t('tolerance.too_few') : t('tolerance.range', { low: level(low), high: level(high) })));
      tables.push(table(t('tolerance.below'), [t('tolerance.share'), this.quantities.get(name).label, t('tolerance.confidence')], [...rows, row(t('tolerance.nominal'), level(of.nominal), ''), row(t('tolerance.mean'), level(of.mean), shown(of.standard_deviation))]));
      const kinds = new Map([...DEVIATIONS, ...INPUTS].map(({ name: kind, label }) => [kind, label]));
      const contributors = of.contributors.map(({ deviation, share, standard_deviation: deviates }) => {
        const line = row(kinds.get(deviation) ?? wordsOf(deviation).label, `${number(100 * share, 3)}\u202f%`, shown(deviates));
        const bar = html('span', { class: 'bar', 'aria-hidden': 'true' });
        bar.style.setProperty('--share', share);
        line.children[1].append(bar);
        return line;
      });
      if (contributors.length > 0) tables.push(table(t('tolerance.contributors'), [t('tolerance.deviation_of'), t('tolerance.variance'), t('tolerance.by_itself')], contributors));
    }
    if (answer.reasons.length > 0) tables.push(html('div', {}, html('h3', {}, t('tolerance.cannot_be')), html('ul', { class: 'plain' }, answer.reasons.map(({ variants, ...reason }) => html('li', {}, t('study.such_as', { count: number(variants, 9), reason: sentence(detailOf(reason)) }))))));
    this.tables.replaceChildren(...tables);
  }

  /** How many drives lie where, over the same axis as the shares. */
  #histogram(width, min, max) {
    const { of, name } = this.#result;
    const { edges, drives } = of.histogram;
    const all = drives.reduce((sum, count) => sum + count, 0);
    const shares = drives.map((count) => (100 * count) / all);
    const frame = axes(width, HEIGHT / 2, { label: this.quantities.headed(name), min, max }, { label: t('tolerance.share_here'), min: 0, max: 1.05 * Math.max(...shares) });
    shares.forEach((share, index) => {
      const [from, to] = [frame.x(edges[index]), frame.x(edges[index + 1])];
      frame.plot.append(svg('rect', { class: 'histogram', x: from, y: frame.y(share), width: Math.max(0, to - from), height: frame.box.bottom - frame.y(share) }));
    });
    return frame.root;
  }

  /** Shares of drives over the quantity, with bands of confidence, the design without deviations and the limits. */
  #draw() {
    const { of, name, require } = this.#result ?? {};
    this.chart.hidden = !of || of.largest === of.least;
    if (this.chart.hidden || this.chart.clientWidth === 0) return;
    const width = Math.max(260, this.chart.clientWidth);
    const ends = [of.least, of.largest, of.nominal, require.min, require.max].filter((value) => value !== undefined);
    const [low, high] = [Math.min(...ends), Math.max(...ends)];
    const room = 0.04 * (high - low);
    const frame = axes(width, HEIGHT, { label: this.quantities.headed(name), min: low - room, max: high + room }, { label: t('tolerance.share_below'), min: 0, max: 100 });
    const { top, bottom } = frame.box;
    const place = (value, share) => `${frame.x(value).toFixed(1)} ${frame.y(100 * share).toFixed(1)}`;
    const points = [{ share: 0, value: of.least }, ...of.quantiles, { share: 1, value: of.largest }];
    const sure = points.filter((point) => point.low !== undefined && point.high !== undefined);
    if (sure.length > 1) frame.plot.append(svg('path', { class: 'confidence', d: `M${sure.map((point) => place(point.low, point.share)).join('L')}L${sure.toReversed().map((point) => place(point.high, point.share)).join('L')}Z` }));
    for (const end of ['min', 'max']) {
      if (require[end] === undefined) continue;
      const x = frame.x(require[end]);
      const [from, to] = end === 'min' ? [frame.box.left, x] : [x, frame.box.right];
      frame.plot.append(svg('rect', { class: 'beyond', x: from, y: top, width: Math.max(0, to - from), height: bottom - top }), svg('path', { class: 'limit', d: `M${x} ${top}V${bottom}` }));
    }
    frame.plot.append(svg('path', { class: 'curve', d: `M${points.map((point) => place(point.value, point.share)).join('L')}` }));
    for (const { value, share } of of.quantiles) frame.plot.append(svg('circle', { class: 'curve-dot', cx: frame.x(value), cy: frame.y(100 * share), r: 3 }));
    if (of.nominal !== undefined) {
      const x = frame.x(of.nominal);
      frame.plot.append(svg('path', { class: 'now', d: `M${x} ${top}V${bottom}` }), svg('text', { class: 'now-label', x: x + 5, y: top + 14 }, t('tolerance.exact')));
    }
    this.chart.replaceChildren(frame.root, this.#histogram(width, low - room, high + room));
  }
}
