// Where everything stands at an input angle, and what it carries. All numbers are the service's: the path of a tooth's centre
// from the geometry, the loaded teeth from the sweep. What happens here is turning frames, renumbering teeth from one period
// to the next, and interpolation between neighbouring samples.
//
// Frame: the ring's, x along the middle of a tooth space; angles in degrees, counter-clockwise.

import { madeOtherwise } from './design.js';
import { t } from './texts.js';

const RAD = Math.PI / 180;

export const CONTACTS = [
  { key: 'wave_generator', name: t('part.wave_generator'), index: 'H' },
  { key: 'ring', name: t('part.ring'), index: 'K' },
  { key: 'carrier', name: t('part.carrier'), index: 'S' },
];

/** The columns of a sweep's states, apart from angle and tooth number. */
export const LOADS = CONTACTS.flatMap(({ key }) => [`force_${key}_n`, `stress_${key}_mpa`, `rubbing_${key}`]);
const COLUMNS = ['position_deg', 'wave_generator_angle_deg', 'ring_angle_deg', ...LOADS];

export const polar = (radius, deg) => ({ x: radius * Math.cos(deg * RAD), y: radius * Math.sin(deg * RAD) });

const modulo = (value, base) => ((value % base) + base) % base;

/** Lobes of the wave generator, U: as many teeth the carrier has more or fewer than the ring. */
export const lobesOf = ({ drive: { teeth, ring } }) => Math.abs(teeth.count - ring.teeth);

/** What stress times slip over a radian is multiplied by to be pressure times velocity, in MPa m/s: the turning of the wave generator against
 *  the carrier, ring fixed. Of a duty that of the point that is drawn; without friction or speed there is none. */
export function rubbingScale({ drive: { teeth, ring }, load }, sweep) {
  const speedRpm = load?.input_speed_rpm ?? sweep?.duty?.points[sweep.duty.hardest_point].input_speed_rpm;
  if (!sweep?.losses || speedRpm === undefined) return undefined;
  return (1e-3 * (2 * Math.PI * speedRpm) / 60) * (ring.teeth / teeth.count);
}

/** A tooth on a lobe: where zones are unlike, the same slot comes to the next lobe before long. */
const keyOf = ({ tooth, lobe }) => `${tooth} ${lobe ?? 0}`;

/** A sweep's states at one input angle, from row `start` to before `end`. */
class Frame {
  #states;
  #rows;

  constructor(states, start, end) {
    this.#states = states;
    Object.assign(this, { angle: states.input_angle_deg[start], start, end });
  }

  /** `Map(tooth and lobe → row)`, made when it is asked for: a picture needs that of two frames alone. */
  get rows() {
    this.#rows ??= new Map(Array.from({ length: this.end - this.start }, (_, index) => this.#row(this.start + index)).map((row) => [keyOf(row), row]));
    return this.#rows;
  }

  #row(index) {
    const states = this.#states;
    const row = { tooth: states.tooth[index], lobe: states.lobe?.[index], center_radius_mm: states.center_radius_mm[index] };
    // Without friction nothing rubs.
    for (const column of COLUMNS) row[column] = states[column] ? states[column][index] : 0;
    // Only a drive with clearance has teeth in mesh that carry nothing.
    row.loaded = states.loaded?.[index] ?? true;
    return row;
  }
}

/** A sweep's states by input angle. Where loads jump an angle may stand twice, without the tooth that enters and then with it; teeth ascend
 *  within a frame, so a lower one begins the next. */
export function framesOf(states) {
  const { input_angle_deg: angles, tooth } = states;
  const starts = [];
  for (let row = 0; row < tooth.length; row += 1) {
    if (row === 0 || angles[row] !== angles[row - 1] || tooth[row] <= tooth[row - 1]) starts.push(row);
  }
  return starts.map((start, index) => new Frame(states, start, starts[index + 1] ?? tooth.length));
}

/** The tooth that makes every force jump between two frames of a sweep, by entering under load. */
export const enteringBetween = (sweep, before, after) =>
  sweep.enters_under_load ? [...after.rows.values()].find((row) => !before.rows.has(keyOf(row)) && row.loaded) : undefined;

/** A column's value at a share of the way from one to another. Stress goes by the root of the force, so it is its square that is
 *  nearly straight between two states, and up to where both end together. */
export const between = (column, one, other, share) => {
  if (!column.startsWith('stress_')) return one + share * (other - one);
  return Math.sqrt(Math.max(0, one * one + share * (other * other - one * one)));
};

/** After what input angle the loads of a drive repeat, and so many slots and lobes on: `{ deg, slots, lobes }`. Without deviations that is the period, after
 *  which each tooth stands where the one before it stood. Where single items deviate it is as much as the sweep goes over: what deviates then meets as it
 *  did, be it on another lobe. */
function patternOf({ drive: { teeth, ring }, deviations = {} }, { period_deg: periodDeg, transmission_ratio: ratio }, sweep, installed) {
  const deg = sweep?.sweep_period_deg ?? periodDeg;
  const periods = Math.round(deg / periodDeg);
  const lobes = Math.abs(teeth.count - ring.teeth);
  const deviates = (...names) => names.some((name) => [deviations[name]?.amount_um ?? deviations[name] ?? 0].flat().some((item) => item !== 0));
  const ofTeeth = deviates('tooth_radius_um', 'slot_angle_arcsec', 'slot_wall_um', 'carrier_runout');
  const ofRing = deviates('ring_space_um', 'ring_space_angle_arcsec', 'ring_runout');
  const ofLobes = deviates('wave_generator_lobe_um', 'wave_generator_runout');
  for (let on = 0; on < (ofLobes ? 1 : lobes); on += 1) {
    const slots = periods - (on * installed) / lobes;
    // The tooth in slot i, pushed by lobe u, stands in the space m i - s u of the ring.
    const spaces = (slots * teeth.count) / installed + Math.sign(ratio) * on;
    if (Number.isInteger(slots) && !(ofTeeth && slots % installed !== 0) && !(ofRing && spaces % ring.teeth !== 0)) return { deg, slots, lobes: -on };
  }
  return { deg, slots: periods, lobes: 0 };
}

export class Motion {
  constructor(design, geometry, sweep) {
    const { teeth, ring } = design.drive;
    this.theoretical = teeth.count;
    this.installed = teeth.installed ?? teeth.count;
    this.ringTeeth = ring.teeth;
    this.lobes = lobesOf(design);
    this.toothRadius = teeth.radius_mm;
    // Flats lie on the walls of the slot.
    this.halfFlatMm = teeth.shape === 'flat_sided' ? teeth.flat_length_mm / 2 : 0;
    this.toSlotWallMm = Math.sqrt(this.toothRadius ** 2 - this.halfFlatMm ** 2);
    this.geometry = geometry;
    this.sweep = sweep;
    this.madeOtherwise = madeOtherwise(design);
    this.rubbingScale = rubbingScale(design, sweep);
    this.pattern = patternOf(design, geometry, sweep, this.installed);
    this.ratio = geometry.transmission_ratio;
    this.frames = sweep ? framesOf(sweep.states) : [];
    const { x_mm: x, y_mm: y } = geometry.tooth_center_path;
    this.path = x.map((value, index) => ({
      deg: Math.atan2(y[index], value) / RAD,
      radius: Math.hypot(value, y[index]),
    }));
  }

  carrierDeg(inputDeg) {
    return inputDeg / this.ratio;
  }

  /** Polar angle of a tooth's slot in the ring's frame. */
  toothDeg(tooth, inputDeg) {
    return (tooth * 360) / this.installed + this.carrierDeg(inputDeg);
  }

  /** From the middle of a lobe to the valley beside it. */
  get halfLobeDeg() {
    return 180 / this.lobes;
  }

  /** Position ψ of a tooth from the middle of the nearest lobe, behind it where negative. */
  positionDeg(tooth, inputDeg) {
    const half = this.halfLobeDeg;
    return half - modulo(half - (this.toothDeg(tooth, inputDeg) - inputDeg), 2 * half);
  }

  /** The input angle nearest to `nearDeg` at which a tooth stands at position ψ. */
  inputDegAt(tooth, positionDeg, nearDeg) {
    // ψ falls by Z_K/Z_G of the input angle.
    const rate = this.ringTeeth / this.theoretical;
    const pass = (2 * this.halfLobeDeg) / rate;
    const off = (this.positionDeg(tooth, nearDeg) - positionDeg) / rate;
    return nearDeg + off - pass * Math.round(off / pass);
  }

  /** Distance of a tooth's centre from the axis, on its path. */
  centerRadius(toothDeg) {
    const pitch = 360 / this.ringTeeth;
    const deg = toothDeg - pitch * Math.round(toothDeg / pitch);
    const { path } = this;
    let low = 0;
    let high = path.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (path[middle].deg <= deg) low = middle;
      else high = middle;
    }
    const span = path[high].deg - path[low].deg;
    const share = span > 0 ? Math.min(1, Math.max(0, (deg - path[low].deg) / span)) : 0;
    return path[low].radius + share * (path[high].radius - path[low].radius);
  }

  center(tooth, inputDeg) {
    const deg = this.toothDeg(tooth, inputDeg);
    return { ...polar(this.centerRadius(deg), deg), deg };
  }

  /** The loaded teeth of all zones: `{ tooth, zone, isCopy, positionDeg, force, stress, contacts }`, by tooth number. Where the zones are
   *  alike, the states are those of one, and the others' teeth are copies. */
  loaded(inputDeg) {
    if (this.frames.length === 0) return [];
    const { pattern } = this;
    const patterns = Math.floor(inputDeg / pattern.deg);
    const within = inputDeg - patterns * pattern.deg;
    const index = this.#frameAt(within);
    const [from, to] = [this.frames[index].angle, this.frames[index + 1].angle];
    const loaded = [];
    for (const row of this.#between(index, to > from ? Math.min(1, Math.max(0, (within - from) / (to - from))) : 0)) {
      if (!row.loaded) continue;
      const zones = row.lobe === undefined ? Array(this.lobes).keys() : [modulo(row.lobe + patterns * pattern.lobes, this.lobes)];
      for (const zone of zones) {
        const isCopy = row.lobe === undefined && zone > 0;
        const tooth = modulo(row.tooth + patterns * pattern.slots + (row.lobe === undefined ? (zone * this.installed) / this.lobes : 0), this.installed);
        loaded.push({ ...this.#loadedTooth(tooth, zone, row, inputDeg), isCopy });
      }
    }
    return loaded.sort((one, other) => one.tooth - other.tooth);
  }

  /** The last frame but one at most that does not stand behind an angle of the sweep. */
  #frameAt(angle) {
    let low = 0;
    let high = this.frames.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.frames[middle].angle <= angle) low = middle;
      else high = middle;
    }
    return low;
  }

  /** The rows at a share of the way from sample `index` to the next. */
  *#between(index, share) {
    const before = this.frames[index].rows;
    const after = this.frames[index + 1].rows;
    const start = this.geometry.engagement.start_deg;
    const blend = (one, other, t) => {
      const row = { tooth: one.tooth, lobe: one.lobe, loaded: (one.loaded && t < 1) || (other.loaded && t > 0) };
      for (const column of COLUMNS) row[column] = between(column, one[column], other[column], t);
      return row;
    };
    // A tooth that enters under load makes every force jump there, so nothing is interpolated across its entry.
    const entering = enteringBetween(this.sweep, this.frames[index], this.frames[index + 1]);
    const rate = (this.ringTeeth / this.theoretical) * (this.frames[index + 1].angle - this.frames[index].angle);
    const hasEntered = entering && entering.position_deg + (1 - share) * rate <= start;
    for (const row of before.values()) {
      const next = after.get(keyOf(row));
      if (next) {
        const blended = blend(row, next, share);
        if (entering) {
          const held = hasEntered ? next : row;
          blended.loaded = held.loaded;
          for (const column of LOADS) blended[column] = held[column];
        }
        yield blended;
      } else {
        // It leaves at the root, where force and lever arm end together.
        const positionDeg = row.position_deg - share * rate;
        if (positionDeg <= 0) continue;
        const left = positionDeg / row.position_deg;
        const faded = { ...row, position_deg: positionDeg };
        for (const column of LOADS) faded[column] = between(column, 0, row[column], left);
        faded.wave_generator_angle_deg = this.halfLobeDeg - left * (this.halfLobeDeg - row.wave_generator_angle_deg);
        faded.ring_angle_deg = 180 / this.ringTeeth - left * (180 / this.ringTeeth - row.ring_angle_deg);
        yield faded;
      }
    }
    for (const row of after.values()) {
      if (before.has(keyOf(row))) continue;
      const positionDeg = row.position_deg + (1 - share) * rate;
      if (entering) {
        if (hasEntered) yield { ...row, position_deg: positionDeg };
      } else if (positionDeg < start) {
        // It enters where its lever arm is zero, and takes load from there on.
        const came = { ...row, position_deg: positionDeg };
        for (const column of LOADS) came[column] = between(column, 0, row[column], (start - positionDeg) / (start - row.position_deg));
        yield came;
      }
    }
  }

  #loadedTooth(tooth, zone, row, inputDeg) {
    const center = this.center(tooth, inputDeg);
    const radius = Math.hypot(center.x, center.y);
    // φ_H counts from the cam's valley, φ_K from the tip of the ring's tooth, both as seen from the axis.
    const camDeg = inputDeg + (2 * zone + 1) * this.halfLobeDeg - row.wave_generator_angle_deg;
    const spaceDeg = center.deg + (this.lobes * Math.sign(this.ratio) * row.position_deg) / this.ringTeeth;
    const ringDeg = spaceDeg - Math.sign(this.ratio) * (180 / this.ringTeeth - row.ring_angle_deg);
    const contacts = {
      wave_generator: this.#onTooth(radius, center.deg, camDeg, -1),
      ring: this.#onTooth(radius, center.deg, ringDeg, 1),
    };
    const force = {};
    const stress = {};
    const rubbing = {};
    for (const { key } of CONTACTS) {
      force[key] = row[`force_${key}_n`];
      stress[key] = row[`stress_${key}_mpa`];
      rubbing[key] = row[`rubbing_${key}`] * (this.rubbingScale ?? 0);
    }
    contacts.carrier = this.#slotContact(center);
    return { tooth, zone, positionDeg: row.position_deg, center, force, stress, rubbing, contacts };
  }

  /** The point of a tooth's outline that is seen from the axis at an angle, on the near or the far side. */
  #onTooth(radius, centerDeg, deg, side) {
    const off = (deg - centerDeg) * RAD;
    const reach = Math.sqrt(Math.max(0, this.toothRadius ** 2 - (radius * Math.sin(off)) ** 2));
    return polar(radius * Math.cos(off) + side * reach, deg);
  }

  /** The slot's wall, on the side that the service says. */
  #slotContact({ x, y, deg }) {
    const reach = this.geometry.carrier.loaded_wall === 'leading' ? this.toSlotWallMm : -this.toSlotWallMm;
    return { x: x - reach * Math.sin(deg * RAD), y: y + reach * Math.cos(deg * RAD) };
  }
}
