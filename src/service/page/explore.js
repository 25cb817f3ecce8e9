// How a quantity changes over one number of the design, or over two: a curve, or a map in colours, with what is impossible and why.

import { Choice, NumberBox } from './ask.js';
import { axes, spread } from './chart.js';
import { at } from './design.js';
import { html, oncePerFrame, setText, svg } from './dom.js';
import { number, withUnit } from './format.js';
import { thinned } from './grids.js';
import { baseOf, parameterOf, parametersOf, rangeOf, withValues } from './parameters.js';
import { StudyView } from './study-view.js';
import { capital, labelled, listed, parts, t } from './texts.js';
import { detailOf, sentence } from './words.js';

const FIRST_QUANTITY = 'peak_stress_mpa';
const FIRST_PARAMETER = '/drive/teeth/radius_mm';
const NONE = '';

/** So many variants are looked at whenever something changes; more only when they are asked for. */
const MOST_AT_ONCE = 3000;

const FINENESS = [
  { value: 'coarse', label: t('explore.coarse'), curve: 41, map: 21 },
  { value: 'medium', label: t('explore.medium'), curve: 161, map: 51 },
  { value: 'fine', label: t('explore.fine'), curve: 1001, map: 161 },
  { value: 'finest', label: t('explore.finest'), curve: 10001, map: 1000 },
];

const HEIGHT = 380;
/** More than this is not told apart on a screen. */
const MOST_CELLS = 480;
const MOST_POINTS = 2400;

/** From low to high, alike in light and dark: samples of viridis (van der Walt and Smith, 2015). */
const HEAT = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37]];

const rgb = (color) => `rgb(${color.map(Math.round).join(' ')})`;

function heatColor(share) {
  const place = Math.min(1, Math.max(0, share)) * (HEAT.length - 1);
  const index = Math.min(HEAT.length - 2, Math.floor(place));
  return HEAT[index].map((value, part) => value + (place - index) * (HEAT[index + 1][part] - value));
}

/** Extremes of the numbers that there are, by their index. */
function extremes(values) {
  let [least, most] = [-1, -1];
  for (let index = 0; index < values.length; index += 1) {
    if (Number.isNaN(values[index])) continue;
    if (least < 0 || values[index] < values[least]) least = index;
    if (most < 0 || values[index] > values[most]) most = index;
  }
  return { least, most };
}

/** Values that a grid is sampled with to choose its colours. */
const MOST_SAMPLES = 4000;
/** From this ratio of largest to least on, colours go by the logarithm. */
const WIDE_RATIO = 4;

/** How values become colours: `{ low, high, shareOf, isLogarithmic }`. Where a few values are far above all others, these do not take all
 *  colours: `high` is then below the largest. */
function scaleOf(values, least, most) {
  const stride = Math.ceil(values.length / MOST_SAMPLES);
  const sorted = values.filter((value, index) => index % stride === 0 && !Number.isNaN(value)).sort();
  const [low, near] = [least, sorted[Math.floor(0.97 * (sorted.length - 1))] ?? most];
  const high = most - low > 2.5 * (near - low) && near > low ? near : most;
  const isLogarithmic = low > 0 && high / low >= WIDE_RATIO;
  const scale = isLogarithmic ? Math.log : (value) => value;
  const [from, span] = [scale(low), scale(high) - scale(low) || 1];
  return { low, high, isLogarithmic, shareOf: (value) => (scale(value) - from) / span };
}

/** The index of the place next to a value. */
function nearest(values, value) {
  let best = 0;
  for (let index = 1; index < values.length; index += 1) if (Math.abs(values[index] - value) < Math.abs(values[best] - value)) best = index;
  return best;
}

export class Explore extends StudyView {
  #result;
  #cursor = [0, 0];

  /** `onUse(design)` when values are taken into the design. */
  constructor(section, { quantities, onUse }) {
    super({ mostAtOnce: MOST_AT_ONCE, verb: t('explore.look') });
    this.section = section;
    this.quantities = quantities;
    this.onUse = onUse;
    this.#build();
    new ResizeObserver(oncePerFrame(() => this.isShown && this.#draw())).observe(this.chart);
  }

  #build() {
    const changed = () => this.later();
    this.quantity = new Choice(t('study.quantity'), changed);
    this.axes = [t('explore.over'), t('explore.and_over')].map((label, index) => {
      const parameter = new Choice(label, () => this.#span(index));
      const ends = [t('explore.from'), t('explore.to')].map((end) => new NumberBox(labelled(label, end), changed));
      const unit = html('span', { class: 'unit' });
      const range = html('span', { class: 'range' }, parts('explore.range', { from: ends[0].input, to: ends[1].input }), ' ', unit);
      return { parameter, ends, unit, range, element: html('div', { class: 'ask-row' }, parameter.element, range) };
    });
    this.fineness = new Choice(t('explore.steps'), changed);
    this.fineness.offer([{ options: FINENESS }], 'medium');
    this.chart = html('div', { class: 'study-chart', role: 'img' });
    this.legend = html('p', { class: 'heat-legend', hidden: true });
    this.readout = html('p', { class: 'study-readout' });
    this.places = this.axes.map((_, index) => {
      const slider = html('input', { type: 'range', min: 0, step: 1 });
      slider.addEventListener('input', () => {
        this.#cursor[index] = Number(slider.value);
        this.#point();
      });
      const name = html('span', {});
      return { slider, name, element: html('label', { class: 'study-place' }, name, slider) };
    });
    this.use = html('button', { type: 'button', onclick: () => this.#use() }, t('explore.use'));
    this.extremes = html('span', { class: 'extremes' });
    this.reading = html('div', { class: 'study-reading', hidden: true }, this.readout, this.places.map(({ element }) => element), html('div', { class: 'actions' }, this.use, this.extremes));
    this.reasons = html('div', { class: 'study-reasons' });
    this.section.append(
      html('header', {}, html('h2', { id: 'explore-title', tabindex: '-1' }, t('view.explore'))),
      html('p', { class: 'none' }, t('explore.intro')),
      html('div', { class: 'ask' }, html('div', { class: 'ask-row' }, this.quantity.element, this.fineness.element, this.button), this.axes.map(({ element }) => element)),
      this.progress.element,
      this.state,
      this.chart,
      this.legend,
      this.reading,
      this.reasons,
    );
    this.#listen();
  }

  /** A pointer reads the chart off, a press keeps the place. */
  #listen() {
    const place = (event) => {
      if (!this.frame || !this.#result) return;
      const bounds = this.chart.getBoundingClientRect();
      const { x, y } = this.frame.valueAt(event.clientX - bounds.left, event.clientY - bounds.top);
      [x, y].slice(0, this.#result.lines.length).forEach((value, index) => {
        this.#cursor[index] = nearest(this.#result.lines[index].values, value);
      });
      this.#point();
    };
    this.chart.addEventListener('pointermove', (event) => (event.pointerType === 'mouse' && event.buttons === 0) || event.buttons ? place(event) : undefined);
    this.chart.addEventListener('pointerdown', place);
  }

  /** What the design at hand has. */
  offer() {
    const quantities = this.quantities.groupsFor(this.design).map(({ title, quantities: list }) => ({ title, options: list.map(({ name, label }) => ({ value: name, label })) }));
    this.quantity.offer(quantities, FIRST_QUANTITY);
    const groups = new Map();
    for (const { pointer, label, group } of parametersOf(this.design)) groups.set(group, [...(groups.get(group) ?? []), { value: pointer, label }]);
    const parameters = [...groups].map(([title, options]) => ({ title, options }));
    this.axes.forEach(({ parameter }, index) => {
      const before = parameter.value;
      parameter.offer(index === 0 ? parameters : [{ options: [{ value: NONE, label: t('explore.nothing_else') }] }, ...parameters], index === 0 ? FIRST_PARAMETER : NONE);
      if (parameter.value !== before || this.axes[index].ends[0].input.value === '') this.#span(index, true);
    });
  }

  /** The range of an axis anew, around the design's value. */
  #span(index, isQuiet = false) {
    const { parameter, ends, unit, range } = this.axes[index];
    range.hidden = parameter.value === NONE;
    const chosen = parameterOf(this.design, parameter.value);
    if (chosen) {
      const { min, max } = rangeOf(chosen);
      [ends[0].value, ends[1].value] = [min, max];
      setText(unit, chosen.unit);
      for (const end of ends) end.unit = chosen.unit;
    }
    if (!isQuiet) this.later();
  }

  /** The question as it stands, or why there is none: `{ question, pointers, variants, fault }`. */
  ask() {
    const used = this.axes.filter(({ parameter }) => parameter.value !== NONE);
    const pointers = used.map(({ parameter }) => parameter.value);
    if (pointers.length === 2 && pointers[0] === pointers[1]) return { fault: t('explore.same_axes') };
    const fineness = FINENESS.find(({ value }) => value === this.fineness.value);
    const steps = used.length === 1 ? fineness.curve : fineness.map;
    const over = {};
    let variants = 1;
    for (const { parameter, ends } of used) {
      const fault = ends.map((end) => end.fault).find((text) => text !== undefined);
      const [min, max] = ends.map(({ value }) => value);
      if (fault !== undefined) return { fault };
      if (min === undefined || max === undefined) return { fault: t('explore.open_range') };
      if (min >= max) return { fault: t('explore.empty_range', { label: parameter.label, min: number(min), max: number(max) }) };
      const { isWhole } = parameterOf(this.design, parameter.value) ?? {};
      over[parameter.value] = { min, max, ...(isWhole ? {} : { steps }) };
      variants *= isWhole ? Math.floor(max) - Math.ceil(min) + 1 : steps;
    }
    return { question: { study: 'map', base: baseOf(this.design, pointers), over, quantities: [this.quantity.value] }, pointers, variants };
  }

  /** Lines are the axes as they are drawn, each with its stride in the grid, whose last axis is the fastest. */
  take(answer, { design, question, pointers }) {
    const [name] = question.quantities;
    const grid = answer.axes.map((axis, index) => ({ ...axis, stride: answer.axes.slice(index + 1).reduce((product, { values }) => product * values.length, 1) }));
    const lines = pointers.map((pointer) => ({ ...grid.find((axis) => axis.pointer === pointer), ...parameterOf(design, pointer) }));
    const values = answer.quantities[name];
    this.#result = { design, name, lines, values, answer, ...extremes(values) };
    this.#cursor = lines.map(({ values: places, value }) => nearest(places, value));
    this.reading.hidden = false;
    this.places.forEach(({ slider, name: label, element }, index) => {
      const line = lines[index];
      element.hidden = !line;
      if (!line) return;
      setText(label, line.label);
      slider.max = line.values.length - 1;
    });
    this.#showExtremes();
    this.#showReasons();
    this.#draw();
  }

  #variantAt(cursor) {
    return this.#result.lines.reduce((variant, { stride }, index) => variant + stride * cursor[index], 0);
  }

  #placesOf(variant) {
    return this.#result.lines.map(({ stride, values }) => Math.floor(variant / stride) % values.length);
  }

  #placeInWords(cursor) {
    return listed(this.#result.lines.map(({ label, unit, values }, index) => `${label.toLowerCase()} ${withUnit(number(values[cursor[index]], 5), unit)}`));
  }

  #showExtremes() {
    const { least, most, values, name } = this.#result;
    const button = (variant, word) =>
      html(
        'button',
        {
          type: 'button',
          onclick: () => {
            this.#cursor = this.#placesOf(variant);
            this.#point();
          },
        },
        labelled(word, this.quantities.shown(name, values[variant])),
      );
    this.extremes.replaceChildren(...(least < 0 ? [] : [button(least, t('explore.least')), button(most, t('explore.largest'))]));
  }

  #showReasons() {
    const { answer } = this.#result;
    const count = answer.reasons.reduce((sum, { variants }) => sum + variants, 0);
    if (count === 0) {
      this.reasons.replaceChildren();
      return;
    }
    const items = answer.reasons.map(({ variants, first_variant: first, ...reason }, index) =>
      html('li', {}, html('span', { class: 'swatch hatched', 'aria-hidden': 'true' }, this.#result.lines.length === 1 ? String(index + 1) : ''), html('span', {}, t('explore.reason', { count: number(variants, 9), all: number(answer.variants, 9), place: this.#placeInWords(this.#placesOf(first)), reason: sentence(detailOf(reason)) }))),
    );
    this.reasons.replaceChildren(html('h3', {}, t('explore.impossible_here')), html('ul', {}, items));
  }

  #use() {
    const { lines } = this.#result;
    this.onUse(withValues(this.design, lines.map(({ pointer, values }, index) => [pointer, values[this.#cursor[index]]])));
  }

  #draw() {
    const result = this.#result;
    if (!result || this.chart.clientWidth === 0) return;
    const width = Math.max(260, this.chart.clientWidth);
    const height = Math.min(HEIGHT, Math.max(250, 0.75 * width));
    if (result.lines.length === 1) this.#drawCurve(width, height);
    else this.#drawMap(width, height);
    this.chart.replaceChildren(this.frame.root);
    this.cursorMark = svg('path', { class: 'cursor-mark' });
    this.cursorDot = svg('circle', { class: 'cursor-dot', r: 5 });
    this.frame.plot.append(this.cursorMark, this.cursorDot);
    this.chart.setAttribute('aria-label', t('explore.chart', { quantity: this.quantities.headed(result.name), axes: result.lines.map(({ label }) => label.toLowerCase()).join(t('list.and')) }));
    this.#point();
  }

  #axisOf({ label, unit, values }) {
    return { label: unit ? `${label}, ${unit}` : label, min: values[0], max: values.at(-1) };
  }

  #drawCurve(width, height) {
    const { lines: [line], values, name, answer } = this.#result;
    const frame = axes(width, height, this.#axisOf(line), { label: this.quantities.headed(name), ...spread(values) });
    this.frame = frame;
    this.legend.hidden = true;
    const places = line.values;
    const middle = (index) => (places[Math.max(0, index - 1)] + places[Math.max(0, index)]) / 2;
    frame.plot.append(hatch());
    // Runs of one reason are one band.
    for (let index = 0; index < values.length; index += 1) {
      const reason = answer.reason[index];
      if (reason === 0) continue;
      const from = index;
      while (index + 1 < values.length && answer.reason[index + 1] === reason) index += 1;
      const [left, right] = [frame.x(from === 0 ? places[0] : middle(from)), frame.x(index === values.length - 1 ? places.at(-1) : middle(index + 1))];
      frame.plot.append(
        svg('rect', { class: 'impossible-band', x: left, y: frame.box.top, width: Math.max(1, right - left), height: frame.box.bottom - frame.box.top, fill: 'url(#hatch)' }),
        svg('text', { class: 'band-number', x: (left + right) / 2, y: frame.box.top + 18, 'text-anchor': 'middle' }, String(reason)),
      );
    }
    const kept = thinned(values, MOST_POINTS);
    let path = '';
    let isBroken = true;
    for (const index of kept) {
      if (Number.isNaN(values[index])) {
        isBroken = true;
        continue;
      }
      path += `${isBroken ? 'M' : 'L'}${frame.x(places[index]).toFixed(2)} ${frame.y(values[index]).toFixed(2)}`;
      isBroken = false;
    }
    frame.plot.append(svg('path', { class: 'curve', d: path }));
    if (places.length <= 60) kept.filter((index) => !Number.isNaN(values[index])).forEach((index) => frame.plot.append(svg('circle', { class: 'curve-dot', cx: frame.x(places[index]), cy: frame.y(values[index]), r: 2.6 })));
    if (line.value >= places[0] && line.value <= places.at(-1)) {
      const x = frame.x(line.value);
      frame.plot.append(svg('path', { class: 'now', d: `M${x} ${frame.box.top}V${frame.box.bottom}` }), svg('text', { class: 'now-label', x: x + 5, y: frame.box.bottom - 7 }, t('explore.design')));
    }
  }

  #drawMap(width, height) {
    const { lines: [first, second], values, name, least, most } = this.#result;
    const frame = axes(width, height, this.#axisOf(first), this.#axisOf(second));
    this.frame = frame;
    const strides = [first, second].map((line) => Math.ceil(line.values.length / MOST_CELLS));
    const [columns, rows] = [first, second].map((line, index) => Math.ceil(line.values.length / strides[index]));
    const canvas = html('canvas', { width: columns, height: rows });
    const context = canvas.getContext('2d');
    const image = context.createImageData(columns, rows);
    const { low, high, shareOf, isLogarithmic } = scaleOf(values, values[least], values[most]);
    for (let row = 0; row < rows; row += 1) {
      for (let column = 0; column < columns; column += 1) {
        const value = values[first.stride * column * strides[0] + second.stride * row * strides[1]];
        if (Number.isNaN(value)) continue;
        const offset = 4 * ((rows - 1 - row) * columns + column);
        image.data.set([...heatColor(shareOf(value)), 255], offset);
      }
    }
    context.putImageData(image, 0, 0);
    const { left, top, right, bottom } = frame.box;
    frame.plot.append(
      hatch(),
      svg('rect', { x: left, y: top, width: right - left, height: bottom - top, fill: 'url(#hatch)' }),
      svg('image', { href: canvas.toDataURL(), x: left, y: top, width: right - left, height: bottom - top, preserveAspectRatio: 'none', class: 'heat' }),
    );
    const places = [first.value, second.value];
    const isWithin = [first, second].every(({ values: line }, index) => places[index] >= line[0] && places[index] <= line.at(-1));
    if (isWithin) {
      const [x, y] = [frame.x(places[0]), frame.y(places[1])];
      frame.plot.append(svg('path', { class: 'now-cross', d: `M${x - 7} ${y}H${x + 7}M${x} ${y - 7}V${y + 7}` }));
    }
    const ramp = html('span', { class: 'ramp wide', 'aria-hidden': 'true' });
    ramp.style.background = `linear-gradient(to right, ${HEAT.map(rgb).join(', ')})`;
    this.legend.hidden = false;
    this.legend.replaceChildren(
      html('span', {}, labelled(this.quantities.headed(name), '')),
      html('span', { class: 'number' }, number(low, 4)),
      ramp,
      html('span', { class: 'number' }, `${high < values[most] ? '≥ ' : ''}${number(high, 4)}`),
      ...(isLogarithmic ? [html('span', {}, t('explore.logarithm'))] : []),
      html('span', { class: 'swatch hatched', 'aria-hidden': 'true' }),
      html('span', {}, t('explore.impossible')),
      ...(isWithin ? [html('span', {}, t('explore.the_design'))] : []),
      ...(Math.max(...strides) > 1 ? [html('span', {}, t('explore.strides', { count: Math.max(...strides) }))] : []),
    );
  }

  /** Reads off where the cursor stands. */
  #point() {
    const { lines, values, name, answer } = this.#result;
    const variant = this.#variantAt(this.#cursor);
    const value = values[variant];
    const reason = answer.reasons[answer.reason[variant] - 1];
    const here = Number.isNaN(value) ? (reason ? t('explore.impossible_as', { reason: detailOf(reason) }) : t('explore.not_looked_at')) : this.quantities.shown(name, value, 5);
    const place = this.#placeInWords(this.#cursor);
    this.readout.replaceChildren(labelled(capital(place), ''), html('strong', {}, here));
    this.use.disabled = Number.isNaN(value) || lines.every(({ pointer, values: line }, index) => at(this.design, pointer) === line[this.#cursor[index]]);
    this.places.slice(0, lines.length).forEach(({ slider }, index) => {
      if (Number(slider.value) !== this.#cursor[index]) slider.value = this.#cursor[index];
      slider.setAttribute('aria-valuetext', labelled(withUnit(number(lines[index].values[this.#cursor[index]], 5), lines[index].unit), here));
    });
    const { frame } = this;
    if (!frame) return;
    const x = frame.x(lines[0].values[this.#cursor[0]]);
    const y = lines[1] ? frame.y(lines[1].values[this.#cursor[1]]) : frame.y(value);
    this.cursorMark.setAttribute('d', lines[1] ? '' : `M${x} ${frame.box.top}V${frame.box.bottom}`);
    this.cursorDot.setAttribute('visibility', Number.isFinite(y) ? 'visible' : 'hidden');
    if (Number.isFinite(y)) {
      this.cursorDot.setAttribute('cx', x);
      this.cursorDot.setAttribute('cy', y);
    }
  }
}

/** Stripes for what cannot be. */
function hatch() {
  return svg('defs', {}, svg('pattern', { id: 'hatch', width: 8, height: 8, patternUnits: 'userSpaceOnUse', patternTransform: 'rotate(45)' }, svg('rect', { class: 'hatch-ground', width: 8, height: 8 }), svg('rect', { class: 'hatch-stripe', width: 3, height: 8 })));
}
