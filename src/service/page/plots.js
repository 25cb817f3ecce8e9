// Forces and stresses over a tooth's pass, as the paper plots them: over the input angle, or over the place of the contact on
// ring, cam or slot. Jumps stay jumps, peaks are marked, loaded teeth ride along, and a reference is drawn dashed.

import { axes } from './chart.js';
import { html, oncePerFrame, setAttributes, setProperties, setText, svg } from './dom.js';
import { difference, fixed, number } from './format.js';
import { CONTACTS } from './motion.js';
import { ABSCISSAE, abscissaAt, readAt } from './pass.js';
import { labelled, t } from './texts.js';

const QUANTITIES = [
  { key: 'force', title: t('plot.force'), unit: 'N', symbol: 'F', peak: 'force_n' },
  { key: 'stress', title: t('plot.stress'), unit: 'MPa', symbol: 'σ', peak: 'stress_mpa' },
  // Shown where there is friction and a speed.
  { key: 'rubbing', title: t('plot.rubbing'), unit: 'MPa m/s', symbol: 'p·v', peak: 'rubbing', isKnown: (pass) => pass?.rubs === true },
];

/** Room on either side of the pass, so that its first jump does not fall on the axis, and above the largest peak for its number. */
const MARGIN = 0.02;
const HEADROOM = 1.14;

const SCREEN = { height: 270 };
/** Half a page's width in CSS pixels: letters then keep their size on paper. */
const PAPER = { width: 340, height: 165 };

class Plot {
  constructor(quantity, figure, container, owner) {
    Object.assign(this, { quantity, figure, container, owner });
    this.#listen();
  }

  /** Draws axes, lines, jumps and peaks anew; on paper in its own size. */
  draw() {
    const { owner, quantity, container } = this;
    const { pass, abscissa } = owner;
    const isKnown = (candidate) => candidate && (quantity.isKnown?.(candidate) ?? true);
    setProperties(this.figure, { hidden: quantity.isKnown !== undefined && !isKnown(pass) });
    setText(this.figure.querySelector('figcaption'), pass?.isLargest ? t('plot.headed_largest', quantity) : t('plot.headed', quantity));
    this.frame = undefined;
    const passes = [owner.reference, pass].filter(isKnown);
    if (!isKnown(pass) || container.clientWidth === 0) {
      container.replaceChildren();
      return;
    }
    const keys = CONTACTS.map(({ key }) => key).filter((key) => owner.visible.has(key));
    const xs = passes.flatMap(({ x }) => [x[abscissa][0], x[abscissa].at(-1)]);
    const [from, to] = [Math.min(...xs), Math.max(...xs)];
    const most = Math.max(0, ...passes.flatMap((each) => keys.map((key) => each[quantity.key][key].reduce((top, value) => Math.max(top, value), 0))));
    const { width, height } = owner.isPrinting ? PAPER : { width: Math.max(200, container.clientWidth), ...SCREEN };
    const { axis } = ABSCISSAE.find(({ key }) => key === abscissa);
    const room = MARGIN * (to - from);
    this.frame = axes(width, height, { label: axis, min: from - room, max: to + room }, { label: '', min: 0, max: (most || 1) * HEADROOM });
    this.marks = svg('g', {});
    this.cursor = svg('path', { class: 'cursor-mark' });
    this.frame.plot.append(...passes.flatMap((each) => keys.map((key) => this.#line(each, key))), ...keys.map((key) => this.#jumps(key)), this.marks, this.cursor, ...this.#peaks(keys));
    container.replaceChildren(this.frame.root);
    this.drawTeeth(owner.teeth, owner.selected);
    this.showCursor(undefined);
  }

  #at(x, y) {
    return `${this.frame.x(x).toFixed(1)} ${this.frame.y(y).toFixed(1)}`;
  }

  #line(pass, key) {
    const [xs, ys] = [pass.x[this.owner.abscissa], pass[this.quantity.key][key]];
    const d = xs.map((x, index) => `${index === 0 || pass.breaks.has(index) ? 'M' : 'L'}${this.#at(x, ys[index])}`).join('');
    return svg('path', { d, class: `plot-line contact-${key}${pass === this.owner.pass ? '' : ' reference'}` });
  }

  /** Dotted lines join both sides of a jump. */
  #jumps(key) {
    const { pass, abscissa } = this.owner;
    const [xs, ys] = [pass.x[abscissa], pass[this.quantity.key][key]];
    const entry = pass.entersUnderLoad && xs.length > 0 ? [`M${this.#at(xs[0], 0)}L${this.#at(xs[0], ys[0])}`] : [];
    const jumps = [...pass.breaks].map((index) => `M${this.#at(xs[index - 1], ys[index - 1])}L${this.#at(xs[index], ys[index])}`);
    return svg('path', { d: [...entry, ...jumps].join(''), class: `plot-jump contact-${key}` });
  }

  /** A ring and a number mark each peak where the service reports it; a number that would touch the one above it goes below its peak. */
  #peaks(keys) {
    const { pass, abscissa } = this.owner;
    const places = keys.flatMap((key) => {
      const peak = pass.peaks[key][this.quantity.peak];
      const x = peak && abscissaAt(pass, abscissa, peak.position_deg);
      return x === undefined ? [] : [{ key, text: number(peak.value, 4), left: this.frame.x(x), top: this.frame.y(peak.value) }];
    });
    places.sort((one, other) => one.top - other.top);
    let floor = -Infinity;
    return places.flatMap(({ key, text, left, top }) => {
      const above = top - 8;
      const y = above - floor < 18 ? Math.max(above + 25, floor + 13) : above;
      floor = y;
      return [svg('circle', { class: `plot-peak contact-${key}`, cx: left, cy: top, r: 3.5 }), svg('text', { class: `plot-number contact-${key}`, x: left, y, 'text-anchor': 'middle' }, text)];
    });
  }

  /** Where the loaded teeth stand now; the lines stay as they are. */
  drawTeeth(teeth, selected) {
    const { owner, quantity, frame } = this;
    if (!frame) return;
    const marks = [];
    for (const { tooth, isCopy, positionDeg, ...loads } of owner.isPrinting ? [] : teeth) {
      if (isCopy && tooth !== selected) continue;
      const x = abscissaAt(owner.pass, owner.abscissa, positionDeg);
      if (x === undefined) continue;
      if (tooth === selected) marks.push({ class: 'plot-here', d: `M${frame.x(x)} ${frame.box.top}V${frame.box.bottom}` });
      for (const { key } of CONTACTS.filter((contact) => owner.visible.has(contact.key))) {
        const size = tooth === selected ? 4.5 : 2.8;
        marks.push({ class: `plot-mark contact-${key}`, d: `M${this.#at(x, loads[quantity.key][key])}m${-size} 0a${size} ${size} 0 1 0 ${2 * size} 0a${size} ${size} 0 1 0 ${-2 * size} 0` });
      }
    }
    while (this.marks.childElementCount > marks.length) this.marks.lastChild.remove();
    while (this.marks.childElementCount < marks.length) this.marks.append(svg('path', {}));
    marks.forEach((mark, index) => setAttributes(this.marks.children[index], mark));
  }

  /** A line at a place, in every plot at once. */
  showCursor(x) {
    if (!this.frame) return;
    const { top, bottom } = this.frame.box;
    setAttributes(this.cursor, { d: x === undefined ? '' : `M${this.frame.x(x)} ${top}V${bottom}` });
  }

  #listen() {
    const { owner, container } = this;
    const place = ({ clientX }) => {
      const { left, right } = this.frame?.box ?? {};
      const px = clientX - container.getBoundingClientRect().left;
      return px >= left && px <= right ? this.frame.valueAt(px, 0).x : undefined;
    };
    let isDown = false;
    container.addEventListener('pointerdown', (event) => {
      isDown = true;
      container.setPointerCapture(event.pointerId);
      owner.onScrub(place(event));
    });
    container.addEventListener('pointermove', (event) => {
      owner.onCursor(place(event));
      if (isDown) owner.onScrub(place(event));
    });
    container.addEventListener('pointerleave', () => owner.onCursor(undefined));
    for (const end of ['pointerup', 'pointercancel']) container.addEventListener(end, () => (isDown = false));
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
    this.scrubbed = onScrub;
    this.plots = QUANTITIES.map((quantity) => {
      const container = html('div', { class: 'chart', role: 'img', 'aria-label': t('plot.label', quantity) });
      const figure = html('figure', { hidden: quantity.isKnown !== undefined }, html('figcaption', {}, t('plot.headed', quantity)), container);
      charts.append(figure);
      return new Plot(quantity, figure, container, this);
    });
    this.#buildChoices(abscissae, contacts);
    this.#buildReadout(readout);
    new ResizeObserver(oncePerFrame(() => !this.isPrinting && this.draw())).observe(charts);
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
          this.draw();
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
          this.draw();
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
      const row = html('tr', {}, html('th', { scope: 'row' }, t('plot.headed', { title, unit })), cells);
      this.#readingRows.set(key, row);
      return row;
    });
    const head = CONTACTS.map(({ key, name }) => html('th', { scope: 'col' }, html('span', { class: `line contact-${key}`, 'aria-hidden': 'true' }), name));
    readout.append(html('table', { class: 'readout' }, this.place, html('thead', {}, html('tr', {}, html('td', {}), head)), html('tbody', {}, rows)));
  }

  draw() {
    for (const plot of this.plots) plot.draw();
    this.#readOut();
  }

  print(isPrinting) {
    this.isPrinting = isPrinting;
    this.draw();
  }

  setPasses(pass, reference) {
    if (pass === this.pass && reference === this.reference) return;
    this.pass = pass;
    this.reference = reference;
    for (const plot of this.plots) plot.draw();
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
    for (const plot of this.plots) plot.showCursor(x);
    this.#readOut();
  }

  onScrub(x) {
    const reading = x !== undefined && this.pass && readAt(this.pass, this.abscissa, x);
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
    const who = hovers ? t('plot.cursor') : t('mechanism.tooth', { tooth: this.selected });
    const place = x === undefined ? t('plot.no_load') : `${symbol} = ${fixed(x, 2)} ${unit}`;
    setText(this.place, labelled(who, other ? t('plot.with_differences', { place }) : place));
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
