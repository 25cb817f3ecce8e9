// Forces and stresses over a tooth's pass, as the paper plots them: over the input angle, or over the place of the contact on
// ring, cam or slot. Jumps stay jumps, peaks are marked, loaded teeth ride along, and a reference is drawn dashed.

import uPlot from './vendor/uplot.js';
import { html, oncePerFrame, setProperties, setText } from './dom.js';
import { difference, fixed, number } from './format.js';
import { CONTACTS } from './motion.js';
import { ABSCISSAE, abscissaAt, plotted, readAt } from './pass.js';

const QUANTITIES = [
  { key: 'force', title: 'Normal force', unit: 'N', symbol: 'F', peak: 'force_n' },
  { key: 'stress', title: 'Contact stress', unit: 'MPa', symbol: 'σ', peak: 'stress_mpa' },
  // Shown where there is friction and a speed.
  { key: 'rubbing', title: 'Pressure times velocity', unit: 'MPa m/s', symbol: 'p·v', peak: 'rubbing', isKnown: (pass) => pass?.rubs === true },
];

/** Room on either side of the pass, so that its first jump does not fall on the axis. */
const MARGIN = 0.02;

const HEIGHT = 260;
const PRINT_HEIGHT = 200;
const PRINT_WIDTH = 340;
const FONT = '12px system-ui, sans-serif';

/** Colours as the style sheet resolves them in the theme at hand. */
function resolved(names) {
  const probe = html('span', { hidden: true });
  document.body.append(probe);
  const colors = {};
  for (const name of names) {
    probe.style.color = `var(--${name})`;
    colors[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return colors;
}

const COLOR_NAMES = ['text', 'muted', 'line', 'surface', ...CONTACTS.map(({ key }) => `contact-${key}`)];

const faded = (color, alpha) => {
  const parts = color.match(/[\d.]+/g);
  return color.startsWith('rgb') ? `rgba(${parts.slice(0, 3).join(', ')}, ${alpha})` : color;
};

class Plot {
  constructor(quantity, figure, container, owner) {
    this.quantity = quantity;
    this.figure = figure;
    this.container = container;
    this.owner = owner;
    this.marks = html('canvas', { class: 'marks', 'aria-hidden': 'true' });
  }

  /** Builds the chart anew: uPlot fixes axes and colours when it is made. */
  build() {
    this.chart?.destroy();
    const { owner, quantity } = this;
    const { colors } = owner;
    const abscissa = ABSCISSAE.find(({ key }) => key === owner.abscissa);
    const axis = { stroke: colors.muted, font: FONT, labelFont: FONT, grid: { stroke: colors.line, width: 1 }, ticks: { show: false } };
    const line = ({ key }, isReference) => ({
      label: `${isReference ? 'reference ' : ''}${key}`,
      stroke: faded(colors[`contact-${key}`], isReference ? 0.75 : 1),
      width: isReference ? 1.2 : 2,
      dash: isReference ? [5, 4] : undefined,
      points: { show: false },
      spanGaps: false,
      pxAlign: 0,
      show: owner.visible.has(key),
    });
    const options = {
      width: owner.widthOf(this.container),
      height: owner.isPrinting ? PRINT_HEIGHT : HEIGHT,
      legend: { show: false },
      cursor: {
        drag: { x: false, y: false },
        points: { size: 7 },
        y: false,
        sync: { key: 'pass', scales: ['x', null] },
      },
      scales: {
        x: { time: false, range: (_, min, max) => [min - MARGIN * (max - min), max + MARGIN * (max - min)] },
        y: { range: (_, __, max) => [0, (max > 0 ? max : 1) * 1.14] },
      },
      axes: [
        { ...axis, label: abscissa.axis, labelSize: 20, size: 30 },
        { ...axis, size: 56, values: (_, ticks) => ticks.map((tick) => number(tick, 4)) },
      ],
      series: [{}, ...CONTACTS.map((contact) => line(contact, false)), ...CONTACTS.map((contact) => line(contact, true))],
      hooks: {
        draw: [() => this.#drawJumpsAndPeaks()],
        setCursor: [({ cursor }) => owner.onCursor(cursor.left >= 0 ? this.chart?.posToVal(cursor.left, 'x') : undefined)],
        setSize: [() => this.#fitMarks()],
      },
    };
    this.chart = new uPlot(options, this.data(), this.container);
    this.chart.over.append(this.marks);
    this.#fitMarks();
    this.#listen();
  }

  data() {
    const { owner, quantity } = this;
    const keys = CONTACTS.map(({ key }) => key);
    const isKnown = (pass) => pass && (quantity.isKnown?.(pass) ?? true);
    const of = (pass) => (isKnown(pass) ? plotted(pass, owner.abscissa, quantity.key, keys) : [[], ...keys.map(() => [])]);
    const own = of(owner.pass);
    if (isKnown(owner.reference)) return uPlot.join([own, of(owner.reference)]);
    const nothing = own[0].map(() => null);
    return [...own, ...keys.map(() => nothing)];
  }

  update() {
    const { isKnown } = this.quantity;
    const wasHidden = this.figure.hidden;
    setProperties(this.figure, { hidden: isKnown !== undefined && !isKnown(this.owner.pass) });
    if (wasHidden && !this.figure.hidden) this.resize();
    const { title, unit } = this.quantity;
    setText(this.figure.querySelector('figcaption'), `${title}, ${unit}${this.owner.pass?.isLargest ? ', the largest of all teeth' : ''}`);
    this.chart.setData(this.data());
  }

  resize() {
    this.chart.setSize({ width: this.owner.widthOf(this.container), height: this.chart.height });
  }

  #fitMarks() {
    if (!this.chart) return;
    const { width, height } = this.chart.bbox;
    Object.assign(this.marks, { width, height });
    // A canvas that is given a size is empty.
    this.drawTeeth(this.owner.teeth, this.owner.selected);
  }

  #listen() {
    const scrub = (event) => {
      const box = this.chart.over.getBoundingClientRect();
      this.owner.onScrub(this.chart.posToVal(event.clientX - box.left, 'x'));
    };
    let isDown = false;
    this.chart.over.addEventListener('pointerdown', (event) => {
      isDown = true;
      this.chart.over.setPointerCapture(event.pointerId);
      scrub(event);
    });
    this.chart.over.addEventListener('pointermove', (event) => isDown && scrub(event));
    for (const end of ['pointerup', 'pointercancel']) this.chart.over.addEventListener(end, () => (isDown = false));
  }

  /** Dotted lines join both sides of a jump; a ring and a number mark each peak where the service reports it. */
  #drawJumpsAndPeaks() {
    const { owner, quantity, chart } = this;
    const { pass, abscissa, colors } = owner;
    if (!pass || !chart || this.figure.hidden) return;
    const context = chart.ctx;
    const ratio = uPlot.pxRatio;
    const xs = pass.x[abscissa];
    const at = (x, y) => [chart.valToPos(x, 'x', true), chart.valToPos(y, 'y', true)];
    context.save();
    context.lineWidth = 1.2 * ratio;
    context.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    const labels = [];
    for (const { key } of CONTACTS.filter((contact) => owner.visible.has(contact.key))) {
      const values = pass[quantity.key][key];
      context.strokeStyle = colors[`contact-${key}`];
      context.setLineDash([1.5 * ratio, 2.5 * ratio]);
      context.beginPath();
      if (pass.entersUnderLoad && values.length > 0) {
        context.moveTo(...at(xs[0], 0));
        context.lineTo(...at(xs[0], values[0]));
      }
      for (const index of pass.breaks) {
        context.moveTo(...at(xs[index - 1], values[index - 1]));
        context.lineTo(...at(xs[index], values[index]));
      }
      context.stroke();
      const peak = pass.peaks[key][quantity.peak];
      const x = peak && abscissaAt(pass, abscissa, peak.position_deg);
      if (x === undefined) continue;
      const [left, top] = at(x, peak.value);
      context.setLineDash([]);
      context.fillStyle = colors.surface;
      context.beginPath();
      context.arc(left, top, 3.5 * ratio, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
      labels.push({ left, top: top - 8 * ratio, text: number(peak.value, 4), color: colors[`contact-${key}`] });
    }
    // A label that would touch the one above it goes below its peak.
    labels.sort((one, other) => one.top - other.top);
    let floor = -Infinity;
    context.textAlign = 'center';
    for (const label of labels) {
      const isCrowded = label.top - floor < 18 * ratio;
      const top = isCrowded ? Math.max(label.top + 25 * ratio, floor + 13 * ratio) : label.top;
      context.lineWidth = 3 * ratio;
      context.strokeStyle = colors.surface;
      context.strokeText(label.text, label.left, top);
      context.fillStyle = label.color;
      context.fillText(label.text, label.left, top);
      floor = top;
    }
    context.restore();
  }

  /** Where the loaded teeth stand now; drawn over the chart, so that turning the drive does not draw the chart anew. */
  drawTeeth(teeth, selected) {
    const { owner, quantity, chart } = this;
    const context = this.marks.getContext('2d');
    context.clearRect(0, 0, this.marks.width, this.marks.height);
    if (!owner.pass || owner.isPrinting || this.figure.hidden) return;
    const ratio = uPlot.pxRatio;
    for (const { tooth, isCopy, positionDeg, ...loads } of teeth) {
      if (isCopy && tooth !== selected) continue;
      const x = abscissaAt(owner.pass, owner.abscissa, positionDeg);
      if (x === undefined) continue;
      const left = chart.valToPos(x, 'x') * ratio;
      if (tooth === selected) {
        context.strokeStyle = faded(owner.colors.text, 0.55);
        context.lineWidth = ratio;
        context.beginPath();
        context.moveTo(left, 0);
        context.lineTo(left, this.marks.height);
        context.stroke();
      }
      for (const { key } of CONTACTS.filter((contact) => owner.visible.has(contact.key))) {
        const value = loads[quantity.key][key];
        context.fillStyle = owner.colors[`contact-${key}`];
        context.beginPath();
        context.arc(left, chart.valToPos(value, 'y') * ratio, (tooth === selected ? 4.5 : 2.8) * ratio, 0, 2 * Math.PI);
        context.fill();
      }
    }
  }
}

export class Plots {
  abscissa = 'input';
  visible = new Set(CONTACTS.map(({ key }) => key));
  isPrinting = false;
  pass;
  reference;
  teeth = [];
  selected;
  #cursorX;
  #reading = new Map();
  #readingRows = new Map();

  /** `onScrub(positionDeg)` when a place in the plots is picked. */
  constructor({ abscissae, contacts, charts, readout }, onScrub) {
    this.colors = resolved(COLOR_NAMES);
    this.scrubbed = onScrub;
    this.plots = QUANTITIES.map((quantity) => {
      const container = html('div', { class: 'chart', role: 'img', 'aria-label': `${quantity.title} over a tooth’s pass; the table of loaded teeth has the numbers` });
      const figure = html('figure', { hidden: quantity.isKnown !== undefined }, html('figcaption', {}, `${quantity.title}, ${quantity.unit}`), container);
      charts.append(figure);
      return new Plot(quantity, figure, container, this);
    });
    this.#buildChoices(abscissae, contacts);
    this.#buildReadout(readout);
    for (const plot of this.plots) plot.build();
    new ResizeObserver(oncePerFrame(() => !this.isPrinting && this.plots.forEach((plot) => plot.resize()))).observe(charts);
  }

  widthOf(container) {
    return this.isPrinting ? PRINT_WIDTH : Math.max(200, Math.floor(container.clientWidth));
  }

  #buildChoices(abscissae, contacts) {
    for (const { key, label } of ABSCISSAE) {
      const input = html('input', {
        type: 'radio',
        name: 'abscissa',
        value: key,
        checked: key === this.abscissa,
        onchange: () => {
          this.abscissa = key;
          this.rebuild();
        },
      });
      abscissae.append(html('label', {}, input, html('span', {}, label)));
    }
    for (const { key, name, index } of CONTACTS) {
      const input = html('input', {
        type: 'checkbox',
        checked: true,
        onchange: () => {
          if (input.checked) this.visible.add(key);
          else this.visible.delete(key);
          this.rebuild();
        },
      });
      contacts.append(
        html('label', { class: 'series' }, input, html('span', { class: `line contact-${key}`, 'aria-hidden': 'true' }), `${name} `, html('i', { class: 'symbol' }, index)),
      );
    }
  }

  #buildReadout(readout) {
    this.place = html('caption', {});
    const rows = QUANTITIES.map(({ key, title, unit }) => {
      const cells = CONTACTS.map((contact) => {
        const value = html('span', { class: 'number' });
        const delta = html('span', { class: 'delta number' });
        this.#reading.set(`${key} ${contact.key}`, { value, delta });
        return html('td', {}, value, delta);
      });
      const row = html('tr', {}, html('th', { scope: 'row' }, `${title}, ${unit}`), cells);
      this.#readingRows.set(key, row);
      return row;
    });
    const head = CONTACTS.map(({ key, name }) => html('th', { scope: 'col' }, html('span', { class: `line contact-${key}`, 'aria-hidden': 'true' }), name));
    readout.append(html('table', { class: 'readout' }, this.place, html('thead', {}, html('tr', {}, html('td', {}), head)), html('tbody', {}, rows)));
  }

  rebuild() {
    for (const plot of this.plots) plot.build();
    this.drawTeeth(this.teeth, this.selected);
  }

  /** Colours follow the theme; paper is always light. */
  restyle(isPrinting = false) {
    this.isPrinting = isPrinting;
    this.colors = resolved(COLOR_NAMES);
    this.rebuild();
  }

  setPasses(pass, reference) {
    if (pass === this.pass && reference === this.reference) return;
    this.pass = pass;
    this.reference = reference;
    for (const plot of this.plots) plot.update();
  }

  drawTeeth(teeth, selected) {
    this.teeth = teeth;
    this.selected = selected;
    for (const plot of this.plots) plot.drawTeeth(teeth, selected);
    this.#readOut();
  }

  onCursor(x) {
    if (x === this.#cursorX) return;
    this.#cursorX = x;
    this.#readOut();
  }

  onScrub(x) {
    const reading = this.pass && readAt(this.pass, this.abscissa, x);
    if (reading) this.scrubbed(reading.position);
  }

  /** Under the cursor, or without one where the selected tooth stands. */
  #readOut() {
    const { pass, reference, abscissa } = this;
    const tooth = this.teeth.find((loaded) => loaded.tooth === this.selected);
    const hovers = this.#cursorX !== undefined;
    const x = hovers ? this.#cursorX : pass && tooth && abscissaAt(pass, abscissa, tooth.positionDeg);
    const reading = hovers ? pass && readAt(pass, abscissa, x) : tooth;
    const other = reference && x !== undefined ? readAt(reference, abscissa, x) : undefined;
    const { symbol, unit } = ABSCISSAE.find(({ key }) => key === abscissa);
    const who = hovers ? 'At the cursor' : `Tooth ${this.selected}`;
    const place = x === undefined ? 'carries no load here' : `${symbol} = ${fixed(x, 2)} ${unit}`;
    setText(this.place, `${who}: ${place}${other ? '; differences are from the reference' : ''}`);
    for (const { key, isKnown } of QUANTITIES) {
      setProperties(this.#readingRows.get(key), { hidden: isKnown !== undefined && !isKnown(pass) });
      for (const contact of CONTACTS) {
        const { value, delta } = this.#reading.get(`${key} ${contact.key}`);
        const now = reading?.[key][contact.key];
        setText(value, fixed(now, 1));
        setText(delta, other && reading ? difference(now, other[key][contact.key]) : '');
      }
    }
  }
}
