// The design document: reading and changing it, what it means where it is silent, and what follows from a change.

const keys = (pointer) => pointer.split('/').slice(1);

export function at(design, pointer) {
  return keys(pointer).reduce((value, key) => value?.[key], design);
}

/** The document with one value changed, `undefined` to leave it out, with an object that it was the last of; the old document
 *  stays as it is. */
export function changed(design, pointer, value) {
  const [key, ...rest] = keys(pointer);
  // A value below a word takes the word's place.
  const copy = typeof design === 'string' ? {} : { ...design };
  const inner = rest.length === 0 ? value : changed(design?.[key] ?? {}, `/${rest.join('/')}`, value);
  const isEmptied = value === undefined && rest.length > 0 && Object.keys(inner).length === 0;
  if (inner === undefined || isEmptied) delete copy[key];
  else copy[key] = inner;
  return copy;
}

export const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);

/** What a document means that names no law, and no way of adding approaches up. */
export const lawOf = (design) => at(design, '/model/stiffness/law') ?? (isBall(design) ? 'hertz' : compatibilityOf(design) === 'projection' ? 'linear' : 'johnson');
export const compatibilityOf = (design) => at(design, '/model/compatibility') ?? 'virtual_work';

export const isBall = (design) => at(design, '/drive/teeth/shape') === 'ball';

/** Outer over largest inner radius of a ring, where the design gives no outer radius. */
export const RIM = 1.2;

export const outerRadiusOf = (design, { ring }) => at(design, '/parts/ring/outer_radius_mm') ?? RIM * (ring.root_radius_mm + (at(design, '/parts/ring/clearance_um') ?? 0) / 1000);

/** Laws that `projection` takes. */
const PROJECTED = new Set(['linear', 'palmgren', 'fixed']);

/** Lobes of the wave generator: as many teeth the carrier has to have more or fewer than the ring. */
export function lobesOf(design) {
  const { kind = 'ellipse', lobes } = design.drive?.wave_generator ?? {};
  return { ellipse: 2, eccentric: 1 }[kind] ?? (Number.isInteger(lobes) && lobes > 0 ? lobes : 2);
}

/** The document with a ring that suits the number of lobes. */
export function withRing(design) {
  const [count, teeth] = [at(design, '/drive/teeth/count'), at(design, '/drive/ring/teeth')];
  if (typeof count !== 'number' || typeof teeth !== 'number') return design;
  return changed(design, '/drive/ring/teeth', count + (teeth > count ? 1 : -1) * lobesOf(design));
}

/** Mean radius and stroke of a wave generator of whatever kind: another kind begins as the one that comes nearest. */
export function sizeOf(design) {
  const wave = design.drive?.wave_generator ?? {};
  const toothRadius = at(design, '/drive/teeth/radius_mm') ?? 0;
  const { semi_major_mm: a = 58, semi_minor_mm: b = 56 } = wave;
  const means = { eccentric: wave.radius_mm, harmonic: wave.mean_radius_mm, harmonic_path: wave.mean_path_radius_mm - toothRadius };
  const strokes = { eccentric: wave.eccentricity_mm, harmonic: wave.amplitude_mm, harmonic_path: wave.amplitude_mm };
  const [mean = (a + b) / 2, stroke = (a - b) / 2] = [means[wave.kind], strokes[wave.kind]];
  const tidy = (value) => Number(value.toPrecision(9));
  return { mean: tidy(mean), stroke: tidy(stroke), low: tidy(mean - stroke), high: tidy(mean + stroke), path: tidy(mean + toothRadius) };
}

/** Laws suit shapes: balls have Hertz's, and only they; a law outside `PROJECTED` needs virtual work. */
export function withLaw(design) {
  const isSuited = lawOf(design) === 'fixed' || isBall(design) === (lawOf(design) === 'hertz');
  const suited = isSuited ? design : changed(design, '/model/stiffness', undefined);
  return !PROJECTED.has(lawOf(suited)) ? changed(suited, '/model/compatibility', 'virtual_work') : suited;
}

/** Where approaches are projected, a law that `projection` does not take becomes the linear one. */
export const withProjectedLaw = (design) =>
  compatibilityOf(design) === 'projection' && !PROJECTED.has(lawOf(design)) ? changed(design, '/model/stiffness', { law: 'linear' }) : design;

/** Input over output speed, ring fixed: what the counts of a document say, be the drive possible or not. */
export function ratioOf(design) {
  const [count, teeth] = [at(design, '/drive/teeth/count'), at(design, '/drive/ring/teeth')];
  const ratio = count / (count - teeth);
  return Number.isFinite(ratio) ? Number(ratio.toPrecision(6)) : undefined;
}

/** The document with the counts that a ratio of input to output speed asks for, ring fixed: of the slots as many hold a tooth as
 *  before, all or every second and so on, where that is possible. */
export function withRatio(design, ratio) {
  const { count, installed } = design.drive?.teeth ?? {};
  const lobes = lobesOf(design);
  const next = Math.round(lobes * Math.abs(ratio));
  const counted = changed(changed(design, '/drive/teeth/count', next), '/drive/ring/teeth', next - lobes * Math.sign(ratio));
  if (typeof installed !== 'number') return counted;
  let left = Math.max(1, Math.round(count / installed));
  while (next % left !== 0) left -= 1;
  return changed(counted, '/drive/teeth/installed', next / left);
}

/** What the form starts friction with: a lubricated pair, and a light bearing under the middle of the race. */
export const USUAL_FRICTION = { coefficient: 0.05, bearing: 0.002 };
export const USUAL_SPEED_RPM = 1500;

/** The mean radius of the wave generator: where a bearing under the teeth would be. */
export const bearingRadiusOf = (design) => sizeOf(design).mean;

/** Friction is that of all contacts, or of none. */
export function withFriction(design) {
  if (at(design, '/friction/wave_generator/kind') === undefined) return changed(design, '/friction', undefined);
  const pointers = ['ring', 'carrier'].map((part) => `/friction/${part}/coefficient`);
  return pointers.reduce((next, pointer) => (at(next, pointer) === undefined ? changed(next, pointer, USUAL_FRICTION.coefficient) : next), design);
}

/** A duty has speeds of its own, and is swept at equal intervals. */
export const withDuty = (design) =>
  at(design, '/load/duty') === undefined ? design : changed(changed(design, '/load/input_speed_rpm', undefined), '/sweep/tolerance', undefined);

/** Parts otherwise than nominal, and what gives way behind contacts, go with virtual work alone; the law that was meant stays. */
export function withVirtualWork(design) {
  if (compatibilityOf(design) !== 'projection') return design;
  return changed(changed(design, '/model/stiffness/law', lawOf(design)), '/model/compatibility', 'virtual_work');
}

const SERIES = '/model/series_compliance_mm_per_n';

/** Whether the service adds its estimates of the supports' compliance. */
export const isEstimated = (design) => at(design, SERIES) === 'estimated';

/** The estimates for the parts as they are held, by contact. */
export const estimatesOf = ({ sweep }) =>
  Object.fromEntries((sweep?.series_compliance_estimates ?? []).filter(({ is_as_held: isAsHeld }) => isAsHeld).map(({ contact, compliance_mm_per_n: compliance }) => [contact, Number(compliance.toPrecision(3))]));

/** The document with the estimates taken over: as a word, or for one contact as a number where the others have numbers. */
export function withEstimate(design, contact, answers) {
  const isNumbers = isGiven(at(design, SERIES)) && !isEstimated(design);
  return withVirtualWork(isNumbers ? changed(design, `${SERIES}/${contact}`, estimatesOf(answers)[contact]) : changed(design, SERIES, 'estimated'));
}

/** One number takes the place of the word: the other contacts then have their estimates as numbers. */
export const withOtherEstimates = (design, before, answers) =>
  withVirtualWork(isEstimated(before) ? changed(design, SERIES, { ...estimatesOf(answers), ...at(design, SERIES) }) : design);

export const isGiven = (value) => (typeof value === 'object' && value !== null ? Object.values(value).some(isGiven) : Boolean(value));

/** What makes the parts of a design other than the nominal ones: `{ drawn, undrawn }`, as a drawing has it or none. */
export const madeOtherwise = ({ modification, parts, deviations }) => ({
  drawn: [isGiven(modification) && 'modification', Object.values(parts ?? {}).some((part) => isGiven(part?.clearance_um)) && 'clearances'].filter(Boolean),
  undrawn: isGiven(deviations),
});
