// The drive drawn to scale, twice: whole, and one tooth enlarged with its slot upright. Every outline is a profile of the
// geometry or a circle of the document; every place and force comes from `Motion`.

import { html, setAttributes, setProperties, setText, svg } from './dom.js';
import { number, withUnit } from './format.js';
import { CONTACTS, polar } from './motion.js';
import { labelled, parts, small, t } from './texts.js';

/** The ring's body beyond its root and the longest arrow, as shares of what is seen; neither is a result. */
const RING_BODY = 0.045;
const LONGEST_ARROW = 0.09;
const ARROW_HEAD = 0.016;

/** Outlines of the whole drive are true to this share of its radius: a small part of a pixel, also in print. */
const FINEST = 6000;

/** Of more teeth than this the whole drive shows every second, every third and so on, with their slots and arrows: those between
 *  would fall on the same pixel. */
const MOST_TEETH = 1440;

/** Of more lobes than this only the first has a line from the axis. */
const MOST_SPOKES = 12;

/** Tooth spaces, slots and teeth that the enlarged view has on either side. */
const NEAR = 5;

const points = (curve) => curve.x_mm.map((x, index) => ({ x, y: curve.y_mm[index] }));

const xy = ({ x, y }) => `${x.toFixed(4)} ${y.toFixed(4)}`;

const polyline = (list) => `M${list.map(xy).join('L')}`;

/** A line that ends where it begins. */
const closed = (list) => `${polyline(list.slice(0, -1))}Z`;

const circle = (radius) =>
  `M${radius} 0A${radius} ${radius} 0 1 1 ${-radius} 0A${radius} ${radius} 0 1 1 ${radius} 0Z`;

/** Of a line's points those that keep it within a distance of the others, after Douglas and Peucker. */
function thinned(line, distance) {
  const kept = [];
  const keep = (from, to) => {
    const [{ x, y }, end] = [line[from], line[to]];
    const [dx, dy] = [end.x - x, end.y - y];
    const length = Math.hypot(dx, dy);
    let [most, farthest] = [distance, undefined];
    for (let index = from + 1; index < to; index += 1) {
      const [px, py] = [line[index].x - x, line[index].y - y];
      const away = length > 0 ? Math.abs(dx * py - dy * px) / length : Math.hypot(px, py);
      if (away > most) [most, farthest] = [away, index];
    }
    if (farthest === undefined) kept.push(line[from]);
    else {
      keep(from, farthest);
      keep(farthest, to);
    }
  };
  keep(0, line.length - 1);
  kept.push(line.at(-1));
  return kept;
}

/** The ring's flanks over `count` tooth spaces from the `first` on, from the profile of one, true to a distance. */
function flanks(geometry, teeth, first, count, distance) {
  const profile = points(geometry.ring.profile);
  const tooth = distance > 0 ? thinned(profile, distance) : profile;
  const all = [];
  let last = { x: Infinity, y: Infinity };
  for (let index = first; index < first + count; index += 1) {
    const angle = (2 * Math.PI * index) / teeth;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    for (const { x, y } of tooth) {
      const point = { x: cos * x - sin * y, y: sin * x + cos * y };
      if (Math.abs(point.x - last.x) + Math.abs(point.y - last.y) < distance) continue;
      all.push(point);
      last = point;
    }
  }
  return all;
}

/** The carrier: `count` of the fingers between its slots, as the service outlines the first. Of very many teeth one finger stands for
 *  as many as `stride` teeth are apart. */
function carrierOutline({ geometry, installed }, first, count, stride = 1) {
  const { finger, inner_radius_limit_mm: inner, outer_radius_limit_mm: outer } = geometry.carrier;
  if (!finger) return '';
  const corners = points(finger.corners);
  const turned = ({ x, y }, slots) => {
    const angle = (2 * Math.PI * slots) / installed;
    return xy({ x: x * Math.cos(angle) - y * Math.sin(angle), y: x * Math.sin(angle) + y * Math.cos(angle) });
  };
  const fingers = [];
  for (let index = first; index < first + count; index += 1) {
    const from = index * stride;
    const to = Math.min(from + stride, first + installed) - 1;
    const [start, rise, fall, back] = [turned(corners[0], from), turned(corners[1], from), turned(corners[2], to), corners[3] && turned(corners[3], to)];
    fingers.push(`M${start}L${rise}A${outer} ${outer} 0 0 1 ${fall}${back ? `L${back}A${inner} ${inner} 0 0 0 ${start}` : ''}Z`);
  }
  return fingers.join('');
}

function arc(radius, fromDeg, toDeg) {
  return `M${xy(polar(radius, fromDeg))}A${radius} ${radius} 0 0 1 ${xy(polar(radius, toDeg))}`;
}

/** Where the lobes of the wave generator have their middles, in its own frame. */
const lobeAngles = ({ lobes }) => Array.from({ length: lobes }, (_, lobe) => (360 * lobe) / lobes);

/** A cross at the axis of rotation, and from there a line to the middle of each lobe, as far as they can be told apart. */
function camAxis(motion, tip) {
  const cross = tip * 0.05;
  const angles = lobeAngles(motion);
  const spokes = (angles.length <= MOST_SPOKES ? angles : [0]).map((deg) => `M0 0L${xy(polar(tip, deg))}`);
  return `M${-cross} 0H${cross}M0 ${-cross}V${cross}${spokes.join('')}`;
}

/** A tooth with flats, its slot along x; of others nothing, they are circles. */
function flatSided({ toothRadius: radius, halfFlatMm: half, toSlotWallMm: wall }) {
  if (half === 0) return undefined;
  return `M${half} ${wall}H${-half}A${radius} ${radius} 0 0 1 ${-half} ${-wall}H${half}A${radius} ${radius} 0 0 1 ${half} ${wall}Z`;
}

/** A pushing force: an arrow whose head is at the contact. */
function arrow({ center, contacts, force }, key, lengthPerNewton, head) {
  const tip = contacts[key];
  const length = force[key] * lengthPerNewton;
  const reach = Math.hypot(center.x - tip.x, center.y - tip.y);
  if (length < head * 0.1 || reach === 0) return '';
  const [ux, uy] = [(center.x - tip.x) / reach, (center.y - tip.y) / reach];
  const size = Math.min(head, 0.7 * length);
  const barb = (side) => ({ x: tip.x - size * (ux + side * 0.45 * uy), y: tip.y - size * (uy - side * 0.45 * ux) });
  const tail = { x: tip.x - length * ux, y: tip.y - length * uy };
  return `M${xy(tail)}L${xy(tip)}M${xy(barb(1))}L${xy(tip)}L${xy(barb(-1))}`;
}

/** The outlines of a whole drive, true to this share of its radius; of very many teeth every so many. */
export function outlinesOf(motion, finest = FINEST) {
  const { geometry, installed, toothRadius } = motion;
  const { start_deg: startDeg, end_deg: endDeg } = geometry.engagement;
  const outer = geometry.ring.root_radius_mm * (1 + RING_BODY);
  const cam = points(geometry.wave_generator.profile);
  const stride = Math.ceil(installed / MOST_TEETH);
  const teeth = Math.ceil(installed / stride);
  const outlines = {
    ring: `${circle(outer)}${polyline(flanks(geometry, motion.ringTeeth, 0, motion.ringTeeth, outer / finest))}Z`,
    carrier: carrierOutline(motion, 0, teeth, stride),
    cam: closed(thinned(cam, outer / finest)),
    axis: camAxis(motion, cam[0].x),
    zones: lobeAngles(motion).map((deg) => arc(outer * 1.025, deg + endDeg, deg + startDeg)).join(''),
    teeth,
    toothRadius,
    toothOutline: flatSided(motion),
  };
  return { outer, stride, outlines };
}

/** Sets a length of an element as the number that it is: there are hundreds of teeth, and text of numbers takes long both ways. */
const setLength = ({ baseVal }, value) => setProperties(baseVal, { value: Math.fround(value) });

/** The parts as SVG elements, for one of the two views. */
export class Body {
  constructor() {
    this.ring = svg('path', { class: 'part part-ring', 'fill-rule': 'evenodd' });
    this.carrier = svg('path', { class: 'part part-carrier' });
    this.cam = svg('path', { class: 'part part-wave_generator' });
    this.axis = svg('path', { class: 'cam-axis' });
    this.camGroup = svg('g', {}, this.cam, this.axis);
    this.zones = svg('path', { class: 'zones' });
    this.zoneGroup = svg('g', {}, this.zones);
    this.track = svg('path', { class: 'track' });
    this.ghostRing = svg('path', { class: 'ghost' });
    this.ghostCam = svg('path', { class: 'ghost' });
    this.teeth = svg('g', { class: 'teeth' });
    this.arrows = Object.fromEntries(CONTACTS.map(({ key }) => [key, svg('path', { class: `arrow contact-${key}` })]));
    this.world = svg(
      'g',
      {},
      [this.ring, this.carrier, this.camGroup, this.zoneGroup, this.teeth],
      [this.track, this.ghostRing, this.ghostCam],
      Object.values(this.arrows),
    );
    this.circles = [];
  }

  shape(outlines) {
    for (const part of ['ring', 'carrier', 'cam', 'axis', 'zones', 'track']) setAttributes(this[part], { d: outlines[part] ?? '' });
    const tag = outlines.toothOutline ? 'path' : 'circle';
    if (this.circles.some(({ tagName }) => tagName !== tag)) this.circles.splice(0).forEach((tooth) => tooth.remove());
    while (this.circles.length > outlines.teeth) this.circles.pop().remove();
    while (this.circles.length < outlines.teeth) {
      const tooth = svg(tag, { class: 'tooth' });
      this.circles.push(tooth);
      this.teeth.append(tooth);
    }
    for (const tooth of this.circles) {
      if (outlines.toothOutline) setAttributes(tooth, { d: outlines.toothOutline });
      else setLength(tooth.r, outlines.toothRadius);
    }
  }

  /** Places cam, carrier, each `stride`th tooth from the `first` on, and arrows; `turns` are those of ring and carrier pieces. */
  place(motion, inputDeg, loaded, { selected, first, stride, turns, arrows }) {
    for (const part of [this.camGroup, this.zoneGroup, this.ghostCam]) setAttributes(part, { transform: `rotate(${inputDeg})` });
    for (const part of [this.ring, this.track]) setAttributes(part, { transform: `rotate(${turns.ring})` });
    setAttributes(this.carrier, { transform: `rotate(${turns.carrier})` });
    const byTooth = new Map(loaded.teeth.map((tooth) => [tooth.tooth, tooth]));
    const drawn = new Set();
    this.circles.forEach((element, index) => {
      // The selected tooth is never one of those left out.
      const isSelected = stride > 1 && index === Math.floor(selected / stride);
      const tooth = isSelected ? selected : (first + index * stride + motion.installed) % motion.installed;
      drawn.add(tooth);
      const { x, y, deg } = motion.center(tooth, inputDeg);
      const state = byTooth.get(tooth);
      const share = state && Math.max(...Object.values(state[loaded.colouring.key])) / loaded.colouring.most;
      setAttributes(element, { 'data-tooth': tooth });
      if (element.tagName === 'path') setAttributes(element, { transform: `translate(${xy({ x, y })}) rotate(${deg})` });
      else {
        setLength(element.cx, x);
        setLength(element.cy, y);
      }
      element.style.fill = state ? stressColor(share) : '';
      element.classList.toggle('selected', tooth === selected);
    });
    const lengthPerNewton = arrows.longest / loaded.mostForce;
    const pushed = loaded.teeth.filter(({ tooth }) => drawn.has(tooth));
    for (const { key } of CONTACTS) {
      setAttributes(this.arrows[key], { d: pushed.map((tooth) => arrow(tooth, key, lengthPerNewton, arrows.head)).join('') });
    }
  }
}

const COLOURINGS = [
  { key: 'stress', name: t('plot.stress'), unit: 'MPa' },
  { key: 'rubbing', name: t('plot.rubbing'), unit: 'MPa m/s' },
];

/** Colour of a share of the largest stress: three stops, mixed by the style sheet so that each theme has its own. */
export function stressColor(share) {
  const percent = (part) => `${(100 * Math.min(1, Math.max(0, part))).toFixed(1)}%`;
  return share < 0.5
    ? `color-mix(in oklab, var(--stress-mid) ${percent(2 * share)}, var(--stress-low))`
    : `color-mix(in oklab, var(--stress-high) ${percent(2 * share - 1)}, var(--stress-mid))`;
}

export class Mechanism {
  #whole = new Body();
  #detail = new Body();
  #motion;
  #shown;

  /** `onTurn(deg)` while the drawing is dragged, `onSelect(tooth)` when a tooth is clicked, `onDrawings()` for the parts as they are made. */
  constructor({ whole, detail, legend }, { onTurn, onSelect, onDrawings }) {
    this.wholeSvg = whole;
    this.detailSvg = detail;
    this.wholeFlip = svg('g', { transform: 'scale(1 -1)' }, this.#whole.world);
    this.detailFlip = svg('g', { transform: 'scale(1 -1)' }, this.#detail.world);
    whole.append(this.wholeFlip);
    detail.append(this.detailFlip);
    this.legend = legend;
    this.#buildLegend(onDrawings);
    this.zoom = 1;
    this.outermost = 0;
    this.#listen(onTurn, onSelect);
  }

  #buildLegend(onDrawings) {
    this.mostColour = html('span', { class: 'number' });
    this.colouringName = html('span', {});
    this.chosenColouring = html(
      'select',
      { 'aria-label': t('mechanism.coloured_by'), hidden: true, onchange: () => this.#colourBy() },
      COLOURINGS.map(({ key, name }) => html('option', { value: key }, name)),
    );
    this.mostForce = html('span', { class: 'number' });
    const contacts = CONTACTS.map(({ key, name }) =>
      html('li', {}, html('span', { class: `swatch part-${key}`, 'aria-hidden': 'true' }), key === 'carrier' ? t('mechanism.carrier') : name),
    );
    this.ghostItem = html('li', { hidden: true }, html('span', { class: 'swatch ghost', 'aria-hidden': 'true' }), t('comparison.reference'));
    this.legend.append(
      html('ul', { class: 'key' }, contacts, html('li', {}, html('span', { class: 'swatch zone', 'aria-hidden': 'true' }), t('mechanism.zones')), this.ghostItem),
      html('p', { class: 'scale' }, this.chosenColouring, this.colouringName, html('span', { class: 'ramp', 'aria-hidden': 'true' }), ' ', this.mostColour),
      html('p', { class: 'scale' }, labelled(t('mechanism.longest_arrow'), ''), this.mostForce),
      (this.nominal = html('p', { class: 'nominal', hidden: true })),
    );
    this.toDrawings = html('button', { type: 'button', class: 'link', onclick: onDrawings }, t('mechanism.drawings'));
  }

  /** Takes a new drive; the places follow with the next `render`. */
  setMotion(motion) {
    this.#motion = motion;
    const { geometry, installed } = motion;
    const { outer, stride, outlines: whole } = outlinesOf(motion);
    Object.assign(this, { outer, stride });
    this.#whole.shape(whole);
    // Enlarged, only what is near is built, but with every point: it is turned to where the selected tooth stands.
    const spaces = Math.min(motion.ringTeeth, 2 * NEAR + 1);
    const near = flanks(geometry, motion.ringTeeth, -Math.floor(spaces / 2), spaces, 0);
    const ends = [near.at(-1), near[0]].map(({ x, y }) => (Math.atan2(y, x) * 180) / Math.PI);
    const back = [polar(this.outer, ends[0]), polar(this.outer, ends[1])].map(xy);
    const isWhole = spaces === motion.ringTeeth;
    this.shownTeeth = Math.min(installed, 2 * NEAR + 1);
    this.#detail.shape({
      ...whole,
      ring: isWhole ? `${circle(this.outer)}${polyline(near)}Z` : `${polyline(near)}L${back[0]}A${this.outer} ${this.outer} 0 0 0 ${back[1]}Z`,
      carrier: carrierOutline(motion, -Math.floor(this.shownTeeth / 2), this.shownTeeth),
      cam: closed(points(geometry.wave_generator.profile)),
      track: polyline(points(geometry.tooth_center_path)),
      zones: '',
      teeth: this.shownTeeth,
    });
    const peaks = motion.sweep && Object.values(motion.sweep.peaks);
    this.most = {
      force: peaks ? Math.max(...peaks.map((peak) => peak.force_n.value)) : 1,
      stress: peaks ? Math.max(...peaks.map((peak) => peak.stress_mpa.value)) : 1,
    };
    const rubbing = motion.rubbingScale === undefined ? [] : Object.values(motion.sweep.losses.pressure_velocity_mpa_m_per_s);
    // Where nothing slips there is nothing to tell apart.
    this.most.rubbing = Math.max(...rubbing.map((peak) => peak.value), 0) || 1;
    this.rubs = rubbing.length > 0;
    this.#showColouring();
    this.#showNominal(motion.madeOtherwise);
    setText(this.mostForce, peaks ? withUnit(number(this.most.force, 4), 'N') : '–');
  }

  /** The picture is the nominal drive's: on its scale micrometres are less than a pixel. Where parts are made otherwise it says so. */
  #showNominal({ drawn, undrawn }) {
    setProperties(this.nominal, { hidden: drawn.length === 0 && !undrawn });
    if (this.nominal.hidden) return;
    const words = [t('mechanism.nominal')];
    if (drawn.length > 0) words.push(' ', ...parts('mechanism.drawn', { what: drawn.map((what) => t(`mechanism.${what}`)).join(t('list.and')), drawings: this.toDrawings }));
    if (undrawn) words.push(` ${t('mechanism.undrawn')}`);
    this.nominal.replaceChildren(...words);
  }

  /** What teeth are coloured by: stress, unless pressure times velocity is known and chosen. */
  get colouring() {
    return this.rubs ? this.chosenColouring.value : 'stress';
  }

  #colourBy() {
    this.#showColouring();
    if (this.#shown) this.render(this.#shown);
  }

  #showColouring() {
    setProperties(this.chosenColouring, { hidden: !this.rubs });
    const { key, name, unit } = COLOURINGS.find((candidate) => candidate.key === this.colouring);
    setText(this.colouringName, labelled(this.rubs ? '' : t('mechanism.highest', { name: small(name) }), '0 '));
    setText(this.mostColour, this.#motion.sweep ? withUnit(number(this.most[key], 4), unit) : '–');
  }

  /** Outlines another drive's ring and cam over this one; nothing takes them away. */
  setReference(reference) {
    if (reference === this.reference) return;
    this.reference = reference;
    const outlines = { ring: '', cam: '' };
    if (reference) {
      const { geometry, design } = reference;
      const { teeth } = design.drive.ring;
      outlines.ring = `${polyline(flanks(geometry, teeth, 0, teeth, geometry.ring.root_radius_mm / FINEST))}Z`;
      outlines.cam = closed(points(geometry.wave_generator.profile));
    }
    for (const body of [this.#whole, this.#detail]) {
      setAttributes(body.ghostRing, { d: outlines.ring });
      setAttributes(body.ghostCam, { d: outlines.cam });
    }
    this.ghostItem.hidden = !reference;
    this.outermost = reference?.geometry.ring.root_radius_mm ?? 0;
  }

  /** Draws the drive at an input angle, seen from one of its members. */
  render({ inputDeg, selected, from }) {
    const motion = this.#motion;
    if (!motion) return;
    this.#shown = { inputDeg, selected, from };
    const key = this.colouring;
    const loaded = { teeth: motion.loaded(inputDeg), mostForce: this.most.force, colouring: { key, most: this.most[key] } };
    const viewDeg = { ring: 0, carrier: motion.carrierDeg(inputDeg), wave_generator: inputDeg }[from];
    this.viewDeg = viewDeg;
    const half = Math.max(this.outer * (1 + 2 * LONGEST_ARROW - RING_BODY), this.outermost * 1.02);
    setAttributes(this.wholeSvg, { viewBox: `${-half} ${-half} ${2 * half} ${2 * half}` });
    const seen = 2 * this.outer;
    setAttributes(this.#whole.world, { transform: `rotate(${-viewDeg})` });
    this.#whole.place(motion, inputDeg, loaded, {
      selected,
      first: 0,
      stride: this.stride,
      turns: { ring: 0, carrier: motion.carrierDeg(inputDeg) },
      arrows: { longest: LONGEST_ARROW * seen, head: ARROW_HEAD * seen },
    });
    this.#renderDetail(loaded, inputDeg, selected);
    return loaded.teeth;
  }

  #renderDetail(loaded, inputDeg, selected) {
    const motion = this.#motion;
    const { geometry, toothRadius, ringTeeth } = motion;
    const root = geometry.ring.root_radius_mm;
    const pitch = (2 * Math.PI * root) / ringTeeth;
    const width = Math.max(5 * toothRadius, 2.3 * pitch) / this.zoom;
    const height = 0.92 * width;
    const inner = geometry.carrier.inner_radius_limit_mm;
    // Zoomed in, the view closes in on where tooth and ring meet.
    const middle = root - Math.min(0.44 * height, (root - inner) / 2 + toothRadius * 0.3);
    const deg = motion.toothDeg(selected, inputDeg);
    const space = 360 / ringTeeth;
    setAttributes(this.detailSvg, { viewBox: `${-width / 2} ${-middle - height / 2} ${width} ${height}` });
    setAttributes(this.#detail.world, { transform: `rotate(${90 - deg})` });
    this.#detail.place(motion, inputDeg, loaded, {
      selected,
      first: selected - Math.floor(this.shownTeeth / 2),
      stride: 1,
      turns: { ring: space * Math.round(deg / space), carrier: deg },
      arrows: { longest: LONGEST_ARROW * 3 * width, head: ARROW_HEAD * 2.2 * width },
    });
  }

  #listen(onTurn, onSelect) {
    const place = (event) => {
      const box = this.wholeSvg.getBoundingClientRect();
      const x = event.clientX - box.left - box.width / 2;
      const y = box.top + box.height / 2 - event.clientY;
      return { deg: (Math.atan2(y, x) * 180) / Math.PI, x: event.clientX, y: event.clientY };
    };
    let drag;
    this.wholeSvg.addEventListener('pointerdown', (event) => {
      if (!this.#shown || event.button !== 0) return;
      this.wholeSvg.setPointerCapture(event.pointerId);
      const at = place(event);
      drag = { start: at, deg: at.deg, inputDeg: this.#shown.inputDeg, moved: false };
    });
    this.wholeSvg.addEventListener('pointermove', (event) => {
      if (!drag) return;
      const at = place(event);
      drag.moved ||= Math.hypot(at.x - drag.start.x, at.y - drag.start.y) > 4;
      const step = at.deg - drag.deg;
      drag.deg = at.deg;
      // Seen from the wave generator it is the ring that is dragged, and the other way round.
      const sense = this.#shown.from === 'wave_generator' ? -1 : 1;
      drag.inputDeg += sense * (step - 360 * Math.round(step / 360));
      if (drag.moved) onTurn(drag.inputDeg);
    });
    const release = (event) => {
      if (drag && !drag.moved && event.type === 'pointerup') {
        const motion = this.#motion;
        const slot = 360 / motion.installed;
        const deg = drag.start.deg + this.viewDeg - motion.carrierDeg(this.#shown.inputDeg);
        const count = motion.installed;
        onSelect(((Math.round(deg / slot) % count) + count) % count);
      }
      drag = undefined;
    };
    this.wholeSvg.addEventListener('pointerup', release);
    this.wholeSvg.addEventListener('pointercancel', release);
  }
}
