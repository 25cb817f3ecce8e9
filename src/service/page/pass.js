// One tooth's pass through the meshing zone, from where it enters to the root, put together from the samples of one period
// as the paper does it (its figures 8 to 10): each loaded tooth stands for a part of the pass.

import { t } from './texts.js';
import { CONTACTS, LOADS, between, enteringBetween, framesOf, lobesOf, rubbingScale } from './motion.js';

export const ABSCISSAE = [
  { key: 'input', label: t('abscissa.input'), axis: t('abscissa.input_axis'), unit: 'deg', symbol: 'Δj' },
  { key: 'ring', label: t('abscissa.ring'), axis: t('abscissa.ring_axis'), unit: 'deg', symbol: 'φ_K' },
  { key: 'cam', label: t('abscissa.cam'), axis: t('abscissa.cam_axis'), unit: 'deg', symbol: 'φ_H' },
  { key: 'slot', label: t('abscissa.slot'), axis: t('abscissa.slot_axis'), unit: 'mm', symbol: 'ρ' },
];

/** Positions closer than this are one and the same, on both sides of a jump. */
const SAME_DEG = 1e-9;

/** Stretches of the pass, of each of which the largest load is drawn where items deviate. */
const MOST_STRETCHES = 200;

const isSamePlace = (one, other) => one.breaksAfter === other.breaksAfter && Math.abs(one.row.position_deg - other.row.position_deg) <= SAME_DEG;

/** The largest of each load of two teeth at one place. */
const largestOf = (one, other) => ({ ...one, ...Object.fromEntries(LOADS.map((column) => [column, Math.max(one[column], other[column])])) });

/** The states of a sweep from the entry to the root: `{ row, breaksAfter, step }`, whether the loads jump behind one, and how far a tooth goes to
 *  the next frame. */
function statesOnTheWay(sweep, rate, isLargest) {
  const frames = framesOf(sweep.states);
  const all = [];
  // The last sample repeats the first, teeth renumbered.
  for (let index = 0; index < frames.length - 1; index += 1) {
    const { angle, rows } = frames[index];
    const step = (frames[index + 1].angle - angle) / rate;
    const breaksAfter = !isLargest && enteringBetween(sweep, frames[index], frames[index + 1]) !== undefined;
    for (const row of rows.values()) all.push({ row, breaksAfter, step });
  }
  // Where an angle stands twice, what was before the jump comes first.
  return all.sort((one, other) => {
    const ahead = other.row.position_deg - one.row.position_deg;
    return Math.abs(ahead) > SAME_DEG ? ahead : other.breaksAfter - one.breaksAfter;
  });
}

/** Where zones are unlike, teeth on several lobes come by the same place, and carry there the same; where items deviate, each another load. */
function placesOf(all, isLargest) {
  const stretch = isLargest ? (all[0].row.position_deg - all.at(-1).row.position_deg) / MOST_STRETCHES : 0;
  const points = [];
  all.forEach((point, index) => {
    const last = points.at(-1);
    const isSame = index > 0 && (isSamePlace(all[index - 1], point) || last.row.position_deg - point.row.position_deg < stretch);
    if (!isSame) points.push({ ...point });
    else if (isLargest) last.row = largestOf(last.row, point.row);
  });
  return points;
}

/** Indices before which the loads jump. */
function breaksOf(points) {
  const breaks = new Set();
  points.forEach(({ row, breaksAfter, step }, index) => {
    const next = points[index + 1];
    if (!breaksAfter || !next) return;
    // A tooth on another lobe may come by between two frames of this one, and still before the jump.
    const isBetween = row.position_deg - next.row.position_deg < step - SAME_DEG;
    if (!(isBetween && next.breaksAfter)) breaks.add(index + 1);
  });
  return breaks;
}

/** `{ x: { abscissa: [] }, force: { contact: [] }, stress: { contact: [] }, rubbing: { contact: [] }, position: [], breaks: Set of indices }`,
 *  `rubbing` being pressure times velocity where `rubs` says that it is known; where items deviate each load is the largest of
 *  all teeth that come by, and `isLargest` says so; a break at an
 *  index stands between that point and the one before it. */
export function passOf(design, sweep) {
  const rate = design.drive.teeth.count / design.drive.ring.teeth;
  // Where items deviate each tooth has a course of its own.
  const isLargest = sweep.sweep_period_deg !== undefined;
  const points = placesOf(statesOnTheWay(sweep, rate, isLargest), isLargest);
  const column = (name) => points.map(({ row }) => row[name]);
  const position = column('position_deg');
  const scale = rubbingScale(design, sweep);
  const pass = {
    position,
    // Ascending, as the columns of x are.
    travelled: position.map((deg) => -deg),
    x: {
      input: position.map((deg) => (180 / lobesOf(design) - deg) * rate),
      ring: column('ring_angle_deg'),
      cam: column('wave_generator_angle_deg'),
      slot: column('center_radius_mm'),
    },
    force: {},
    stress: {},
    rubbing: {},
    rubs: scale !== undefined,
    isLargest,
    entersUnderLoad: sweep.enters_under_load,
    breaks: breaksOf(points),
    peaks: {},
  };
  // The peak of a duty may be another point's.
  const rubbingPeaks = sweep.duty ? undefined : sweep.losses?.pressure_velocity_mpa_m_per_s;
  for (const { key } of CONTACTS) {
    pass.force[key] = column(`force_${key}_n`);
    pass.stress[key] = column(`stress_${key}_mpa`);
    pass.rubbing[key] = column(`rubbing_${key}`).map((rubbing) => rubbing * (scale ?? 0));
    pass.peaks[key] = { ...sweep.peaks[key], rubbing: rubbingPeaks?.[key] };
  }
  return pass;
}

/** The place of an abscissa's value between two points of the pass, or nothing outside it. */
function placeOf(xs, x) {
  if (xs.length < 2 || x < xs[0] || x > xs.at(-1)) return undefined;
  let low = 0;
  let high = xs.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] <= x) low = middle;
    else high = middle;
  }
  return { low, high, share: xs[high] > xs[low] ? (x - xs[low]) / (xs[high] - xs[low]) : 0 };
}

/** Reads the pass where an abscissa has a value; across a jump, at the nearer side. */
export function readAt(pass, abscissa, x) {
  const place = placeOf(pass.x[abscissa], x);
  if (!place) return undefined;
  const share = pass.breaks.has(place.high) ? Math.round(place.share) : place.share;
  const value = (column) => column[place.low] + share * (column[place.high] - column[place.low]);
  const reading = { position: value(pass.position), force: {}, stress: {}, rubbing: {} };
  for (const { key } of CONTACTS) {
    reading.force[key] = value(pass.force[key]);
    reading.rubbing[key] = value(pass.rubbing[key]);
    const stress = pass.stress[key];
    reading.stress[key] = between(`stress_${key}_mpa`, stress[place.low], stress[place.high], share);
  }
  return reading;
}

/** The abscissa's value at a position, or nothing where the tooth carries no load. */
export function abscissaAt(pass, abscissa, positionDeg) {
  const place = placeOf(pass.travelled, -positionDeg);
  if (!place) return undefined;
  const xs = pass.x[abscissa];
  return xs[place.low] + place.share * (xs[place.high] - xs[place.low]);
}
