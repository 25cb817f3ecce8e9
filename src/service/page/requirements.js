// What a drive must do, as its form asks for it, and the searches that follow: one for each kind of drive that may be, so that few numbers
// are free in each.

import { at } from './design.js';
import { CONTACTS } from './motion.js';
import { standardRadiiMm } from './rounding.js';
import { STRENGTHS } from './strengths.js';

export const ROOT = '/find';

const number = (name, label, symbol, unit, more) => ({ kind: 'number', pointer: `${ROOT}/${name}`, label, symbol, unit, ...more });
const flag = (name, label) => ({ kind: 'flag', pointer: `${ROOT}/${name}`, label });

const asked = (requirements, name) => at(requirements, `${ROOT}/${name}`);

/** The ring is as thick as drawings make it: its root radius times this is its outer radius. */
const RIM = 1.2;

/** Below this share of a slot's width a finding warns of the wall between slots; steeper flanks than this angle it warns of too. */
const LEAST_WALL = 0.25;
/** A finding speaks of fingers that give way by more than this share of what a tooth does at its contacts. */
const SOFTEST_FINGER = 0.2;
/** Against yield and fatigue of the fingers under a typical strength of the material. */
const LEAST_SAFETY = 1.5;
/** A rule of thumb: lower carriers are sheets. */
const LEAST_CARRIER_MM = 3;
const STEEPEST_DEG = 70;
const LEAST_IN_MESH = 2;

/** Sizes are looked at up to so many times what is asked: a search tells how far a limit would have to give only as far as it looks. */
const BEYOND = 2;

const EVALUATIONS = { quick: 10_000, usual: 40_000, thorough: 200_000 };

const lobesAsked = (requirements) => asked(requirements, 'lobes') ?? 3;

/** Kinds of wave generator: their lobes, and what is free of them within the ring's root radius and the largest tooth radius. */
const WAVE_GENERATORS = [
  {
    name: 'harmonic_two',
    label: 'two lobes, harmonic path of the teeth',
    of: () => ({ lobes: 2, fixed: { kind: 'harmonic_path', lobes: 2 }, free: (root, tooth) => ({ mean_path_radius_mm: [0.12 * root, root], amplitude_mm: [0.02 * tooth, tooth] }) }),
  },
  {
    name: 'ellipse',
    label: 'two lobes, ellipse',
    of: () => ({ lobes: 2, fixed: { kind: 'ellipse' }, free: (root) => ({ semi_major_mm: [0.12 * root, root], semi_minor_mm: [0.12 * root, root] }) }),
  },
  {
    name: 'eccentric',
    label: 'one lobe, eccentric circle',
    of: () => ({ lobes: 1, fixed: { kind: 'eccentric' }, free: (root, tooth) => ({ radius_mm: [0.12 * root, root], eccentricity_mm: [0.02 * tooth, tooth] }) }),
  },
  {
    name: 'harmonic_more',
    label: 'more lobes, harmonic path',
    of: (requirements) => ({
      lobes: lobesAsked(requirements),
      fixed: { kind: 'harmonic_path', lobes: lobesAsked(requirements) },
      free: (root, tooth) => ({ mean_path_radius_mm: [0.12 * root, root], amplitude_mm: [0.02 * tooth, tooth] }),
    }),
  },
];

const JOHNSON = { compatibility: 'virtual_work', stiffness: { law: 'johnson' } };

const SHAPES = [
  { name: 'cylinder', label: 'cylinders', model: JOHNSON, free: (tooth, width) => ({ width_mm: [0.08 * width, width] }) },
  { name: 'flat_sided', label: 'cylinders with flats', model: JOHNSON, free: (tooth, width) => ({ width_mm: [0.08 * width, width], flat_length_mm: [0.05 * tooth, 1.2 * tooth] }) },
  { name: 'ball', label: 'balls, without grooves', model: { compatibility: 'virtual_work', stiffness: { law: 'hertz' } }, free: () => ({}) },
];

/** What can count, with the quantity that says so. */
const GOALS = [
  { name: 'small', label: 'small outer diameter', quantity: 'outer_diameter_mm', goal: 'min' },
  { name: 'strong', label: 'high torque capacity', quantity: 'torque_capacity_output_nm', goal: 'max' },
  { name: 'narrow', label: 'narrow teeth', quantity: 'tooth_width_mm', goal: 'min' },
  { name: 'stiff', label: 'high torsional stiffness', quantity: 'torsional_stiffness_min_nm_per_rad', goal: 'max' },
  { name: 'even', label: 'small transmission error', quantity: 'transmission_error_peak_to_peak_deg', goal: 'min' },
  { name: 'efficient', label: 'high efficiency', quantity: 'efficiency_ring_fixed', goal: 'max' },
];
const MOST_GOALS = 4;

/** What somebody may begin with. */
export const FIRST = {
  find: {
    ratio: 20,
    output_torque_nm: 200,
    outer_diameter_mm: 120,
    width_mm: 30,
    allowable_stress_mpa: 1500,
    wall: LEAST_WALL,
    carrier_space_mm: LEAST_CARRIER_MM,
    fingers: SOFTEST_FINGER,
    carrier_strength: '42crmo4-qt',
    finger_safety: LEAST_SAFETY,
    friction: 0.05,
    wave_generators: { harmonic_two: true, ellipse: true, eccentric: true },
    shapes: { cylinder: true },
    goals: { small: true, strong: true },
    rounded: true,
    effort: 'usual',
  },
};

export const GROUPS = [
  {
    title: 'Motion and load',
    pointer: `${ROOT}/load`,
    open: true,
    fields: [
      number('ratio', 'Ratio, ring fixed', 'i_HG', '', { whole: true, likely: 20 }),
      number('ratio_max', 'Ratio, up to', '', '', { whole: true, optional: () => 'just that' }),
      number('output_torque_nm', 'Output torque', 'M_G', 'N·m', { likely: 200 }),
      number('input_speed_rpm', 'Input speed', 'n', '1/min', { optional: () => 'not asked', step: 100 }),
    ],
  },
  {
    title: 'Space',
    pointer: `${ROOT}/space`,
    open: true,
    fields: [
      number('outer_diameter_mm', 'Greatest outer diameter', '', 'mm', { likely: 120, step: 1 }),
      number('width_mm', 'Greatest width of the teeth', '', 'mm', { likely: 30, step: 1 }),
    ],
  },
  {
    title: 'Strength',
    pointer: `${ROOT}/bears`,
    open: true,
    hint: 'A Hertz stress, without a factor of safety: bearing steel and case-hardened steel bear 1500 MPa (ISO 281, ISO 6336-5), alloy steel of 300 HV some 770. Fingers of the carrier have a disc at one end and a ring that joins their far ends.',
    fields: [
      number('allowable_stress_mpa', 'Allowable contact stress', 'σ', 'MPa', { likely: 1500, step: 50 }),
      ...CONTACTS.map(({ key, name }) => number(`allowable_${key}_mpa`, `Lower at the ${name.toLowerCase()}`, '', 'MPa', { optional: () => 'no lower', step: 50 })),
      { kind: 'choice', pointer: `${ROOT}/carrier_strength`, label: 'Strength of the carrier', options: STRENGTHS },
      number('finger_safety', 'Least safety of its fingers', 'S', '', { optional: () => 'not asked', step: 0.1 }),
    ],
  },
  {
    title: 'Buildable',
    pointer: `${ROOT}/build`,
    open: true,
    hint: 'Teeth never touch each other, stay inside the carrier and meet flanks that are not too steep. The finger deflection is estimated for cylinders, held at both ends.',
    fields: [
      flag('undercut', 'Undercut ring tips are allowed'),
      number('wall', 'Wall between slots, over their width', '', '', { optional: () => 'not asked', step: 0.05 }),
      number('carrier_space_mm', 'Height of the carrier between wave generator and ring', '', 'mm', { optional: () => 'not asked', step: 0.5 }),
      number('fingers', 'Greatest finger deflection over contact deflection', '', '', { optional: () => 'not asked', step: 0.05 }),
      number('efficiency', 'Least efficiency', 'η', '', { optional: () => 'not asked', step: 0.01 }),
      number('friction', 'Coefficient of friction', 'μ', '', { likely: 0.05, step: 0.01 }),
      flag('rounded', 'Round lengths to 0.01 mm'),
      flag('standard', 'Standard diameters of rollers and balls'),
    ],
  },
  {
    title: 'Kinds',
    pointer: `${ROOT}/kinds`,
    open: true,
    parts: [
      {
        title: 'Wave generator',
        fields: [...WAVE_GENERATORS.map(({ name, label }) => flag(`wave_generators/${name}`, label)), number('lobes', 'More lobes', 'U', '', { whole: true, optional: () => '3' })],
      },
      { title: 'Teeth', fields: SHAPES.map(({ name, label }) => flag(`shapes/${name}`, label)) },
    ],
  },
  {
    title: 'Goals',
    pointer: `${ROOT}/goals`,
    open: true,
    hint: 'One to four. With several there is no single best drive, but those that none beats in everything.',
    fields: [
      ...GOALS.map(({ name, label }) => flag(`goals/${name}`, label)),
      {
        kind: 'choice',
        pointer: `${ROOT}/effort`,
        label: 'Effort, for each kind',
        options: Object.entries(EVALUATIONS).map(([value, count]) => ({ value, label: `${value}: ${count / 1000}\u202f000 variants` })),
      },
    ],
  },
];

const FIELDS = {
  outer_diameter_mm: 'outer_diameter_mm',
  tooth_width_mm: 'width_mm',
  torque_capacity_output_nm: 'output_torque_nm',
  undercut: 'undercut',
  slot_wall_over_slot_width: 'wall',
  carrier_radial_space_mm: 'carrier_space_mm',
  carrier_finger_share: 'fingers',
  finger_safety: 'finger_safety',
  efficiency_ring_fixed: 'efficiency',
  peak_stress_wave_generator_mpa: 'allowable_wave_generator_mpa',
  peak_stress_ring_mpa: 'allowable_ring_mpa',
  peak_stress_carrier_mpa: 'allowable_carrier_mpa',
};

/** Which field of the form a limit is of; undefined of those that are always asked. */
export const fieldOf = (quantity) => (FIELDS[quantity] ? `${ROOT}/${FIELDS[quantity]}` : undefined);

export const goalsOf = (requirements) => GOALS.filter(({ name }) => asked(requirements, `goals/${name}`)).map(({ quantity, goal }) => ({ quantity, goal }));

const range = ([min, max]) => ({ min, max });

function required(requirements, shape) {
  const stresses = CONTACTS.flatMap(({ key }) => {
    const allowable = asked(requirements, `allowable_${key}_mpa`);
    return allowable === undefined ? [] : [[`peak_stress_${key}_mpa`, { max: allowable }]];
  });
  const [wall, efficiency, width, space, fingers, safety] = ['wall', 'efficiency', 'width_mm', 'carrier_space_mm', 'fingers', 'finger_safety'].map((name) => asked(requirements, name));
  return {
    outer_diameter_mm: { max: asked(requirements, 'outer_diameter_mm') },
    torque_capacity_output_nm: { min: asked(requirements, 'output_torque_nm') },
    tooth_width_mm: { max: width },
    ...(asked(requirements, 'undercut') ? {} : { undercut: false }),
    ...(wall === undefined ? {} : { slot_wall_over_slot_width: { min: wall } }),
    ...(space === undefined ? {} : { carrier_radial_space_mm: { min: space } }),
    // Of other teeth no estimate tells.
    ...(fingers === undefined || shape.name !== 'cylinder' ? {} : { carrier_finger_share: { max: fingers } }),
    ...(safety === undefined || shape.name === 'ball' ? {} : { finger_safety: { min: safety } }),
    ...(efficiency === undefined ? {} : { efficiency_ring_fixed: { min: efficiency } }),
    ...Object.fromEntries(stresses),
    teeth_in_mesh_min: { min: LEAST_IN_MESH },
    tooth_gap_min_mm: { min: 0 },
    tooth_center_clearance_inner_mm: { min: 0 },
    tooth_center_clearance_outer_mm: { min: 0 },
    ring_pressure_angle_max_deg: { max: STEEPEST_DEG },
  };
}

/** What is missing or cannot be, by field: `[{ pointer, detail }]`. */
export function faultsOf(requirements) {
  const faults = [];
  const fault = (name, detail) => faults.push({ pointer: `${ROOT}/${name}`, code: 'out_of_range', detail });
  const [least, most] = ratiosOf(requirements);
  if (least < 2) fault('ratio', 'a ratio is 2 or more');
  else if (most < least) fault('ratio_max', `the range is empty: it ends below ${least}`);
  for (const name of ['output_torque_nm', 'outer_diameter_mm', 'width_mm', 'allowable_stress_mpa']) {
    if (asked(requirements, name) <= 0) fault(name, 'this is above 0');
  }
  const lobes = lobesAsked(requirements);
  if (!Number.isInteger(lobes) || lobes < 2) fault('lobes', 'a whole number, 2 or more');
  const counts = goalsOf(requirements).length;
  if (counts === 0) fault('goals', 'choose at least one');
  if (counts > MOST_GOALS) fault('goals', `choose at most ${MOST_GOALS}`);
  if (!WAVE_GENERATORS.some(({ name }) => asked(requirements, `wave_generators/${name}`))) fault('kinds', 'choose at least one wave generator');
  if (!SHAPES.some(({ name }) => asked(requirements, `shapes/${name}`))) fault('kinds', 'choose at least one shape of teeth');
  const isEmpty = ['ratio', 'output_torque_nm', 'outer_diameter_mm', 'width_mm', 'allowable_stress_mpa'].some((name) => asked(requirements, name) === undefined);
  return { faults, isEmpty };
}

function ratiosOf(requirements) {
  const least = asked(requirements, 'ratio');
  return [least, asked(requirements, 'ratio_max') ?? least];
}

/** A search for each kind of drive that may be: `[{ label, question }]`, with `fault` in words where no whole numbers of teeth make the ratio. */
export function searchesOf(requirements) {
  const [least, most] = ratiosOf(requirements);
  const rootMm = (BEYOND * asked(requirements, 'outer_diameter_mm')) / 2 / RIM;
  const goals = goalsOf(requirements);
  const rubs = asked(requirements, 'efficiency') !== undefined || goals.some(({ quantity }) => quantity === 'efficiency_ring_fixed');
  const coefficient = asked(requirements, 'friction');
  const speed = asked(requirements, 'input_speed_rpm');
  const searches = [];
  for (const wave of WAVE_GENERATORS.filter(({ name }) => asked(requirements, `wave_generators/${name}`))) {
    const { lobes, fixed, free: waveFree } = wave.of(requirements);
    for (const shape of SHAPES.filter(({ name }) => asked(requirements, `shapes/${name}`))) {
      const label = `${wave.name === 'harmonic_more' ? `${lobes} lobes` : wave.label.split(',')[0]}, ${wave.label.split(', ')[1]}, ${shape.label}`;
      const [fewest, mostSlots] = [Math.ceil(lobes * least - 1e-9), Math.floor(lobes * most + 1e-9)];
      if (fewest > mostSlots) {
        searches.push({ label, fault: lobes === 1 ? 'with one lobe a ratio is a whole number' : `with ${lobes} lobes a ratio is a multiple of 1/${lobes}` });
        continue;
      }
      const toothMm = Math.min(0.3 * rootMm, (Math.PI * rootMm) / fewest);
      const widthMm = BEYOND * asked(requirements, 'width_mm');
      const radiusRange = [0.08 * toothMm, Math.min(toothMm, widthMm)];
      const radii = asked(requirements, 'standard') ? standardRadiiMm(shape.name, radiusRange) : undefined;
      if (radii?.length === 0) {
        searches.push({ label, fault: 'no standard diameter fits into this space' });
        continue;
      }
      const ranges = {
        ...Object.fromEntries(Object.entries(waveFree(rootMm, toothMm)).map(([name, ends]) => [`/drive/wave_generator/${name}`, range(ends)])),
        '/drive/teeth/radius_mm': radii === undefined ? range(radiusRange) : { one_of: radii },
        ...Object.fromEntries(Object.entries(shape.free(toothMm, widthMm)).map(([name, ends]) => [`/drive/teeth/${name}`, range(ends)])),
        ...(fewest === mostSlots ? {} : { '/drive/teeth/count': { min: fewest, max: mostSlots } }),
      };
      const base = {
        drive: { wave_generator: fixed, teeth: { shape: shape.name, ...(fewest === mostSlots ? { count: fewest } : {}) } },
        load: { output_torque_nm: asked(requirements, 'output_torque_nm'), allowable_stress_mpa: asked(requirements, 'allowable_stress_mpa'), ...(speed === undefined ? {} : { input_speed_rpm: speed }) },
        model: shape.model,
        ...(asked(requirements, 'finger_safety') === undefined || shape.name === 'ball' ? {} : { parts: { carrier: { strength: asked(requirements, 'carrier_strength') ?? STRENGTHS[0].value } } }),
        ...(rubs ? { friction: { wave_generator: { kind: 'plain', coefficient }, ring: { coefficient }, carrier: { coefficient } } } : {}),
      };
      searches.push({ label, question: { study: 'search', base, free: ranges, require: required(requirements, shape), objectives: goals, evaluations: EVALUATIONS[asked(requirements, 'effort')] } });
    }
  }
  return searches;
}
