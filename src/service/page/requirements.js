// What a drive must do, as its form asks for it, and the searches that follow: one for each kind of drive that may be, so that few numbers
// are free in each.

import { RIM, at, changed } from './design.js';
import * as field from './field.js';
import { number as digits } from './format.js';
import { CONTACTS } from './motion.js';
import { standardRadiiMm } from './rounding.js';
import { STRENGTHS } from './strengths.js';
import { counted, t } from './texts.js';

export const ROOT = '/find';

const number = (name, symbol, unit, more) => field.number(`${ROOT}/${name}`, symbol, unit, more);
const flag = (name) => field.flag(`${ROOT}/${name}`);

const asked = (requirements, name) => at(requirements, `${ROOT}/${name}`);

/** Below this share of a slot's width a finding warns of the wall between slots; steeper flanks than this angle it warns of too. */
const LEAST_WALL = 0.25;
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
    of: () => ({ lobes: 2, fixed: { kind: 'harmonic_path', lobes: 2 }, free: (root, tooth) => ({ mean_path_radius_mm: [0.12 * root, root], amplitude_mm: [0.02 * tooth, tooth] }) }),
  },
  {
    name: 'ellipse',
    of: () => ({ lobes: 2, fixed: { kind: 'ellipse' }, free: (root) => ({ semi_major_mm: [0.12 * root, root], semi_minor_mm: [0.12 * root, root] }) }),
  },
  {
    name: 'eccentric',
    of: () => ({ lobes: 1, fixed: { kind: 'eccentric' }, free: (root, tooth) => ({ radius_mm: [0.12 * root, root], eccentricity_mm: [0.02 * tooth, tooth] }) }),
  },
  {
    name: 'harmonic_more',
    of: (requirements) => ({
      lobes: lobesAsked(requirements),
      fixed: { kind: 'harmonic_path', lobes: lobesAsked(requirements) },
      free: (root, tooth) => ({ mean_path_radius_mm: [0.12 * root, root], amplitude_mm: [0.02 * tooth, tooth] }),
    }),
  },
];

/** Fingers bend as they are held where their strength is calculated, and rims as they are housed. */
const JOHNSON = { compatibility: 'virtual_work', stiffness: { law: 'johnson' }, series_compliance_mm_per_n: 'estimated' };

const SHAPES = [
  { name: 'cylinder', model: JOHNSON, free: (tooth, width) => ({ width_mm: [0.08 * width, width] }) },
  { name: 'flat_sided', model: JOHNSON, free: (tooth, width) => ({ width_mm: [0.08 * width, width], flat_length_mm: [0.05 * tooth, 1.2 * tooth] }) },
  { name: 'ball', model: { compatibility: 'virtual_work', stiffness: { law: 'hertz' } }, free: () => ({}) },
];

/** What can count, with the quantity that says so. */
const GOALS = [
  { name: 'small', quantity: 'outer_diameter_mm', goal: 'min' },
  { name: 'strong', quantity: 'torque_capacity_output_nm', goal: 'max' },
  { name: 'narrow', quantity: 'tooth_width_mm', goal: 'min' },
  { name: 'stiff', quantity: 'torsional_stiffness_min_nm_per_rad', goal: 'max' },
  { name: 'even', quantity: 'transmission_error_peak_to_peak_deg', goal: 'min' },
  { name: 'efficient', quantity: 'efficiency_ring_fixed', goal: 'max' },
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
    ...field.group(`${ROOT}/load`),
    open: true,
    fields: [
      number('ratio', 'i_HG', '', { whole: true, likely: 20 }),
      number('ratio_max', '', '', { whole: true, optional: () => t('empty.one_ratio') }),
      number('output_torque_nm', 'M_G', 'N·m', { likely: 200 }),
      number('input_speed_rpm', 'n', '1/min', { optional: () => t('empty.not_asked'), step: 100 }),
      field.choice(`${ROOT}/cycle`, ['pulsating', 'reversed'].map((value) => ({ value, label: t(`option./load/cycle.${value}`) })), { label: t('label./load/cycle') }),
    ],
  },
  {
    ...field.group(`${ROOT}/space`),
    open: true,
    fields: [
      number('outer_diameter_mm', '', 'mm', { likely: 120, step: 1 }),
      number('width_mm', '', 'mm', { likely: 30, step: 1 }),
    ],
  },
  {
    ...field.group(`${ROOT}/bears`),
    open: true,
    fields: [
      number('allowable_stress_mpa', 'σ', 'MPa', { likely: 1500, step: 50 }),
      ...CONTACTS.map(({ key }) => number(`allowable_${key}_mpa`, '', 'MPa', { optional: () => t('empty.no_lower'), step: 50 })),
      field.choice(`${ROOT}/carrier_strength`, STRENGTHS),
      number('finger_safety', 'S', '', { optional: () => t('empty.not_asked'), step: 0.1 }),
    ],
  },
  {
    ...field.group(`${ROOT}/build`),
    open: true,
    fields: [
      flag('undercut'),
      number('wall', '', '', { optional: () => t('empty.not_asked'), step: 0.05 }),
      number('carrier_space_mm', '', 'mm', { optional: () => t('empty.not_asked'), step: 0.5 }),
      number('efficiency', 'η', '', { optional: () => t('empty.not_asked'), step: 0.01 }),
      number('friction', 'μ', '', { likely: 0.05, step: 0.01 }),
      flag('rounded'),
      flag('standard'),
    ],
  },
  {
    ...field.group(`${ROOT}/kinds`),
    open: true,
    parts: [
      {
        title: t('part.wave_generator'),
        fields: [...WAVE_GENERATORS.map(({ name }) => flag(`wave_generators/${name}`)), number('lobes', 'U', '', { whole: true, optional: () => '3' })],
      },
      { title: t('part.teeth'), fields: SHAPES.map(({ name }) => flag(`shapes/${name}`)) },
    ],
  },
  {
    ...field.group(`${ROOT}/goals`),
    open: true,
    fields: [
      ...GOALS.map(({ name }) => flag(`goals/${name}`)),
      field.choice(
        `${ROOT}/effort`,
        Object.entries(EVALUATIONS).map(([value, count]) => ({ value, label: t(`option.${ROOT}/effort.${value}`, { count: digits(count, 9) }) })),
      ),
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
  const [wall, efficiency, width, space, safety] = ['wall', 'efficiency', 'width_mm', 'carrier_space_mm', 'finger_safety'].map((name) => asked(requirements, name));
  return {
    outer_diameter_mm: { max: asked(requirements, 'outer_diameter_mm') },
    torque_capacity_output_nm: { min: asked(requirements, 'output_torque_nm') },
    tooth_width_mm: { max: width },
    ...(asked(requirements, 'undercut') ? {} : { undercut: false }),
    ...(wall === undefined ? {} : { slot_wall_over_slot_width: { min: wall } }),
    ...(space === undefined ? {} : { carrier_radial_space_mm: { min: space } }),
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

/** A found design with the lower stresses that single contacts had to keep. */
export function withAllowables(design, requirements) {
  const lower = CONTACTS.filter(({ key }) => asked(requirements, `allowable_${key}_mpa`) !== undefined);
  if (lower.length === 0) return design;
  const all = asked(requirements, 'allowable_stress_mpa');
  const stresses = CONTACTS.map(({ key }) => [key, Math.min(all, asked(requirements, `allowable_${key}_mpa`) ?? all)]);
  return changed(design, '/load/allowable_stress_mpa', Object.fromEntries(stresses));
}

/** What is missing or cannot be, by field: `[{ pointer, detail }]`. */
export function faultsOf(requirements) {
  const faults = [];
  const fault = (name, detail) => faults.push({ pointer: `${ROOT}/${name}`, code: 'out_of_range', detail });
  const [least, most] = ratiosOf(requirements);
  if (least < 2) fault('ratio', t('requirement.ratio'));
  else if (most < least) fault('ratio_max', t('requirement.empty_range', { least }));
  for (const name of ['output_torque_nm', 'outer_diameter_mm', 'width_mm', 'allowable_stress_mpa']) {
    if (asked(requirements, name) <= 0) fault(name, t('requirement.positive'));
  }
  const lobes = lobesAsked(requirements);
  if (!Number.isInteger(lobes) || lobes < 2) fault('lobes', t('requirement.lobes'));
  const counts = goalsOf(requirements).length;
  if (counts === 0) fault('goals', t('requirement.one_goal'));
  if (counts > MOST_GOALS) fault('goals', t('requirement.most_goals', { count: MOST_GOALS }));
  if (!WAVE_GENERATORS.some(({ name }) => asked(requirements, `wave_generators/${name}`))) fault('kinds', t('requirement.one_wave_generator'));
  if (!SHAPES.some(({ name }) => asked(requirements, `shapes/${name}`))) fault('kinds', t('requirement.one_shape'));
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
      const kind = wave.name === 'harmonic_more' ? t('requirement.more_lobes', { lobes }) : t(`label.${ROOT}/wave_generators/${wave.name}`);
      const label = t('requirement.search', { wave_generator: kind, shape: t(`label.${ROOT}/shapes/${shape.name}`) });
      const [fewest, mostSlots] = [Math.ceil(lobes * least - 1e-9), Math.floor(lobes * most + 1e-9)];
      if (fewest > mostSlots) {
        searches.push({ label, fault: counted('requirement.no_ratio', lobes) });
        continue;
      }
      const toothMm = Math.min(0.3 * rootMm, (Math.PI * rootMm) / fewest);
      const widthMm = BEYOND * asked(requirements, 'width_mm');
      const radiusRange = [0.08 * toothMm, Math.min(toothMm, widthMm)];
      const radii = asked(requirements, 'standard') ? standardRadiiMm(shape.name, radiusRange) : undefined;
      if (radii?.length === 0) {
        searches.push({ label, fault: t('requirement.no_standard') });
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
        load: { output_torque_nm: asked(requirements, 'output_torque_nm'), allowable_stress_mpa: asked(requirements, 'allowable_stress_mpa'), ...(asked(requirements, 'cycle') === 'reversed' ? { cycle: 'reversed' } : {}), ...(speed === undefined ? {} : { input_speed_rpm: speed }) },
        model: shape.model,
        ...(asked(requirements, 'finger_safety') === undefined || shape.name === 'ball' ? {} : { parts: { carrier: { strength: asked(requirements, 'carrier_strength') ?? STRENGTHS[0].value } } }),
        ...(rubs ? { friction: { wave_generator: { kind: 'plain', coefficient }, ring: { coefficient }, carrier: { coefficient } } } : {}),
      };
      searches.push({ label, question: { study: 'search', base, free: ranges, require: required(requirements, shape), objectives: goals, evaluations: EVALUATIONS[asked(requirements, 'effort')] } });
    }
  }
  return searches;
}
