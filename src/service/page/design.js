// The design document: which fields the form shows, in the document's own groups. A field that the service learns to read
// is one entry here; nothing else in the page knows field names except what is drawn from them.
//
// What comes in several kinds, as a wave generator does, is a `variant`: its tag is chosen, and of all the fields only those of the
// chosen kind are shown. A kind may be `implied`: it is meant where the document has no tag, and then none is written; `otherwise` finds
// it where it depends on the design. A kind's field
// starts with its `start`, a value or what makes one of the design, where the document has none; a field's `preset` is what the service
// takes where nothing is given. What another kind changes beside itself, `adjust` does.

import { STRENGTHS } from './strengths.js';

/** Shares of the value on either side that a slider spans. */
const NARROW = 0.05;
const WIDE = 0.75;

const number = (pointer, label, symbol, unit, more) => ({ kind: 'number', pointer, label, symbol, unit, ...more });
const whole = (pointer, label, symbol, more) => ({ kind: 'number', whole: true, pointer, label, symbol, ...more });
const choice = (pointer, label, options, more) => ({ kind: 'choice', pointer, label, options, ...more });
/** A choice that need not be made: left out, the document says nothing. */
const unlessSaid = (pointer, label, options) => choice(pointer, label, [{ value: '', label: 'not said' }, ...options]);
/** What a document says with `true`, or, where it `starts` with an object, by having that object. */
const flag = (pointer, label, more) => ({ kind: 'flag', pointer, label, ...more });
const variant = (pointer, tag, label, options, more) => ({ kind: 'variant', pointer, tag, label, options, ...more });

/** How far a part is set back from the one without gaps: drawn, and open at its contact until the load closes it. */
const clearance = (part, label) => number(`/parts/${part}/clearance_um`, label, 'c', 'µm', { slider: WIDE, optional: () => 'none', step: 1 });

/** Steel, as the service fills in what a document leaves out. */
const material = (part, label) => ({
  title: label,
  filled: `/materials/${part}`,
  fields: [
    number(`/materials/${part}/youngs_modulus_gpa`, 'Young’s modulus', 'E', 'GPa', { preset: 210, of: label }),
    number(`/materials/${part}/poissons_ratio`, 'Poisson’s ratio', 'ν', '', { preset: 0.3, of: label, step: 0.01 }),
  ],
});

/** A radius that the mechanics leave free, with what is taken where it is left out. */
const freeRadius = (part, label, key, what, symbol, otherwise) => number(`/parts/${part}/${key}_mm`, what, symbol, 'mm', { of: label, optional: () => otherwise });

/** What a document means that names no law, and no way of adding approaches up. */
export const lawOf = (design) => at(design, '/model/stiffness/law') ?? (isBall(design) ? 'hertz' : compatibilityOf(design) === 'projection' ? 'linear' : 'johnson');
export const compatibilityOf = (design) => at(design, '/model/compatibility') ?? 'virtual_work';

const isBall = (design) => at(design, '/drive/teeth/shape') === 'ball';

/** Laws that `projection` takes: the others give way by more than in proportion to the force, or know more than one contact. */
const PROJECTED = new Set(['linear', 'palmgren', 'fixed']);

/** Lobes of the wave generator: as many teeth the carrier has to have more or fewer than the ring. */
export function lobesOf(design) {
  const { kind = 'ellipse', lobes } = design.drive?.wave_generator ?? {};
  return { ellipse: 2, eccentric: 1 }[kind] ?? (Number.isInteger(lobes) && lobes > 0 ? lobes : 2);
}

/** The document with a ring that suits the number of lobes. */
function withRing(design) {
  const [count, teeth] = [at(design, '/drive/teeth/count'), at(design, '/drive/ring/teeth')];
  if (typeof count !== 'number' || typeof teeth !== 'number') return design;
  return changed(design, '/drive/ring/teeth', count + (teeth > count ? 1 : -1) * lobesOf(design));
}

/** Mean radius and stroke of a wave generator of whatever kind: another kind begins as the one that comes nearest. */
function sizeOf(design) {
  const wave = design.drive?.wave_generator ?? {};
  const toothRadius = at(design, '/drive/teeth/radius_mm') ?? 0;
  const { semi_major_mm: a = 58, semi_minor_mm: b = 56 } = wave;
  const means = { eccentric: wave.radius_mm, harmonic: wave.mean_radius_mm, harmonic_path: wave.mean_path_radius_mm - toothRadius };
  const strokes = { eccentric: wave.eccentricity_mm, harmonic: wave.amplitude_mm, harmonic_path: wave.amplitude_mm };
  const [mean = (a + b) / 2, stroke = (a - b) / 2] = [means[wave.kind], strokes[wave.kind]];
  const tidy = (value) => Number(value.toPrecision(9));
  return { mean: tidy(mean), stroke: tidy(stroke), low: tidy(mean - stroke), high: tidy(mean + stroke), path: tidy(mean + toothRadius) };
}

/** Laws suit shapes: balls have Hertz's, and only they; and Hertz's wants virtual work. */
function withLaw(design) {
  const isSuited = lawOf(design) === 'fixed' || isBall(design) === (lawOf(design) === 'hertz');
  const suited = isSuited ? design : changed(design, '/model/stiffness', undefined);
  return PROJECTED.has(lawOf(suited)) ? suited : changed(suited, '/model/compatibility', 'virtual_work');
}

/** Johnson's law gives way to the linear one where approaches are projected. */
const withProjectedLaw = (design) =>
  compatibilityOf(design) === 'projection' && !PROJECTED.has(lawOf(design)) ? changed(design, '/model/stiffness', { law: 'linear' }) : design;

/** Input over output speed, ring fixed: what the counts of a document say, be the drive possible or not. */
function ratioOf(design) {
  const [count, teeth] = [at(design, '/drive/teeth/count'), at(design, '/drive/ring/teeth')];
  const ratio = count / (count - teeth);
  return Number.isFinite(ratio) ? Number(ratio.toPrecision(6)) : undefined;
}

/** The document with the counts that a ratio of input to output speed asks for, ring fixed: of the slots as many hold a tooth as
 *  before, all or every second and so on, where that is possible. */
function withRatio(design, ratio) {
  const { count, installed } = design.drive?.teeth ?? {};
  const lobes = lobesOf(design);
  const next = Math.round(lobes * Math.abs(ratio));
  const counted = changed(changed(design, '/drive/teeth/count', next), '/drive/ring/teeth', next - lobes * Math.sign(ratio));
  if (typeof installed !== 'number') return counted;
  let left = Math.max(1, Math.round(count / installed));
  while (next % left !== 0) left -= 1;
  return changed(counted, '/drive/teeth/installed', next / left);
}

const ratio = {
  ...whole('/ratio', 'Ratio, ring fixed', 'i_HG'),
  derived: { read: ratioOf, write: withRatio },
  offersSearch: true,
  refuses: (value, design) => {
    const lobes = lobesOf(design);
    const others = lobes > 1 ? `, or ${lobes} times it is whole` : '';
    const isWhole = Math.abs(lobes * value - Math.round(lobes * value)) < 0.005;
    return isWhole && Math.abs(value) >= 2 ? undefined : `A ratio is a whole number, 2 or more${others}; negative where the carrier turns against the input. The last one stands.`;
  },
  next: (value, sense) => (value + sense > -2 && value + sense < 2 ? 2 * sense : value + sense),
};

/** With one lobe a harmonic support is an eccentric. */
const SUPPORT_LOBES = whole('/drive/wave_generator/lobes', 'Lobes', 'U', { likely: 2, start: (design) => Math.max(2, lobesOf(design)), adjust: withRing });
const LOBES = whole('/drive/wave_generator/lobes', 'Lobes', 'U', { likely: 2, start: lobesOf, adjust: withRing });
const AMPLITUDE = number('/drive/wave_generator/amplitude_mm', 'Amplitude', 'e', 'mm', { slider: WIDE, likely: 1, start: (design) => sizeOf(design).stroke });
const WIDTH = number('/drive/teeth/width_mm', 'Tooth width', 'L_1', 'mm', { slider: WIDE, likely: 15, start: (design) => 3 * (at(design, '/drive/teeth/radius_mm') ?? 5) });

/** Across the path; without one the part is straight there. */
const groove = (contact, label) =>
  number(`/drive/teeth/groove_radius_mm/${contact}`, label, 'r_g', 'mm', { slider: 0.05, optional: () => 'no groove', step: 0.1 });

/** How far below a contact its body stands still. */
const depth = (contact, label) =>
  number(`/model/stiffness/depth_mm/${contact}`, label, 'd', 'mm', { optional: (design) => `r = ${at(design, '/drive/teeth/radius_mm') ?? ''}`, step: 0.5 });

const stiffness = (contact, label, symbol) => number(`/model/stiffness/${contact}_n_per_mm`, label, symbol, 'N/mm', { start: 500000, likely: 500000 });

const compliance = (contact, label) =>
  number(`/model/series_compliance_mm_per_n/${contact}`, label, '1/k', 'mm/N', { optional: () => '0', likely: 1e-6, adjust: withVirtualWork });

/** What the form starts friction with: a lubricated pair, and a light bearing under the middle of the race. */
export const USUAL_FRICTION = { coefficient: 0.05, bearing: 0.002 };
const USUAL_SPEED_RPM = 1500;

/** The mean radius of the wave generator: where a bearing under the teeth would be. */
export const bearingRadiusOf = (design) => sizeOf(design).mean;

/** Friction is that of all contacts, or of none. */
function withFriction(design) {
  if (at(design, '/friction/wave_generator/kind') === undefined) return changed(design, '/friction', undefined);
  const pointers = ['ring', 'carrier'].map((part) => `/friction/${part}/coefficient`);
  return pointers.reduce((next, pointer) => (at(next, pointer) === undefined ? changed(next, pointer, USUAL_FRICTION.coefficient) : next), design);
}

/** A duty has speeds of its own, and is swept at equal intervals. */
const withDuty = (design) =>
  at(design, '/load/duty') === undefined ? design : changed(changed(design, '/load/input_speed_rpm', undefined), '/sweep/tolerance', undefined);

/** Parts otherwise than nominal, and what gives way behind contacts, go with virtual work alone; the law that was meant stays. */
export function withVirtualWork(design) {
  if (compatibilityOf(design) !== 'projection') return design;
  return changed(changed(design, '/model/stiffness/law', lawOf(design)), '/model/compatibility', 'virtual_work');
}

const modified = (key, label, symbol, more) => number(`/modification/${key}`, label, symbol, 'µm', { optional: () => '0', step: 1, adjust: withVirtualWork, ...more });
const turned = (part, label, symbol) => modified(`${part}_rotation_arcsec`, label, symbol, { unit: '″' });

const RELIEF = '/modification/ring_tip_relief';
const hasRelief = (design) => at(design, RELIEF) !== undefined;
/** It begins within the mesh, whatever the number of lobes. */
const reliefOf = (_, { geometry }) => ({ amount_um: 5, start_deg: Math.floor((2 / 3) * (geometry?.engagement.start_deg ?? 90)), power: 2 });

/** A part off the axis. */
const runout = (part, label) => [
  number(`/deviations/${part}_runout/amount_um`, label, 'e', 'µm', { optional: () => '0', step: 1, adjust: withVirtualWork }),
  number(`/deviations/${part}_runout/angle_deg`, 'in the direction', 'α', 'deg', { of: label, optional: () => '0', step: 5, adjust: withVirtualWork }),
];

const isGiven = (value) => (typeof value === 'object' && value !== null ? Object.values(value).some(isGiven) : Boolean(value));

/** What makes the parts of a design other than the nominal ones: `{ drawn, undrawn }`, as a drawing has it or none. */
export const madeOtherwise = ({ modification, parts, deviations }) => ({
  drawn: [isGiven(modification) && 'modification', Object.values(parts ?? {}).some((part) => isGiven(part?.clearance_um)) && 'clearances'].filter(Boolean),
  undrawn: isGiven(deviations),
});

const RUBBING = number('/friction/wave_generator/coefficient', 'Friction, teeth on the cam', 'μ_H', '', { slider: WIDE, likely: 0.05, start: USUAL_FRICTION.coefficient, step: 0.005 });
const BEARING = [
  number('/friction/wave_generator/bearing_coefficient', 'Friction of the bearing', 'μ_b', '', { slider: WIDE, likely: 0.002, start: USUAL_FRICTION.bearing, step: 0.0005 }),
  number('/friction/wave_generator/bearing_radius_mm', 'Its radius', 'R_b', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
];
const BEARING_LIFE = [
  number('/friction/wave_generator/bearing_load_rating_n', 'Its dynamic load rating', 'C', 'N', { optional: () => 'no life asked', likely: 9000, step: 100 }),
  choice('/friction/wave_generator/bearing_element', 'What rolls in it', [
    { value: 'ball', label: 'Balls' },
    { value: 'roller', label: 'Rollers' },
  ]),
];
const wearRate = (contact, label) =>
  number(`/friction/wear_rate_mm3_per_nm/${contact}`, label, 'w', 'mm³/(N·m)', { optional: () => '0', likely: 1e-8 });
const ELSEWHERE = [
  number('/friction/ring/coefficient', 'Friction, teeth on the ring', 'μ_K', '', { slider: WIDE, likely: 0.05, step: 0.005 }),
  number('/friction/carrier/coefficient', 'Friction, teeth in the slots', 'μ_S', '', { slider: WIDE, likely: 0.05, step: 0.005 }),
  wearRate('wave_generator', 'Wear rate, wave generator'),
  wearRate('ring', 'Wear rate, ring'),
  wearRate('carrier', 'Wear rate, carrier'),
];

export const GROUPS = [
  {
    title: 'Wave generator',
    pointer: '/drive/wave_generator',
    open: true,
    fields: [
      variant('/drive/wave_generator', 'kind', 'Kind', [
        {
          value: 'ellipse',
          label: 'Ellipse',
          implied: true,
          fields: [
            number('/drive/wave_generator/semi_major_mm', 'Semi-major axis', 'a', 'mm', { slider: NARROW, likely: 58, start: (design) => sizeOf(design).high }),
            number('/drive/wave_generator/semi_minor_mm', 'Semi-minor axis', 'b', 'mm', { slider: NARROW, likely: 56, start: (design) => sizeOf(design).low }),
          ],
        },
        {
          value: 'eccentric',
          label: 'Eccentric circle',
          fields: [
            number('/drive/wave_generator/radius_mm', 'Radius', 'R_0', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
            number('/drive/wave_generator/eccentricity_mm', 'Eccentricity', 'e', 'mm', { slider: WIDE, likely: 1, start: (design) => sizeOf(design).stroke }),
          ],
        },
        {
          value: 'harmonic',
          label: 'Harmonic support',
          fields: [
            SUPPORT_LOBES,
            number('/drive/wave_generator/mean_radius_mm', 'Mean radius', 'R_0', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
            AMPLITUDE,
          ],
        },
        {
          value: 'harmonic_path',
          label: 'Harmonic path of the teeth',
          fields: [
            LOBES,
            number('/drive/wave_generator/mean_path_radius_mm', 'Mean radius of the path', 'R', 'mm', { slider: NARROW, likely: 62, start: (design) => sizeOf(design).path }),
            AMPLITUDE,
          ],
        },
      ], { name: 'Wave generator', adjust: withRing, terms: ['lobes'] }),
    ],
  },
  {
    title: 'Teeth',
    pointer: '/drive/teeth',
    open: true,
    fields: [
      ratio,
      number('/drive/teeth/radius_mm', 'Tooth radius', 'r', 'mm', {
        slider: WIDE,
        likely: 5,
        mark: (answers) => {
          const radius = answers.geometry?.undercut.critical_tooth_radius_mm;
          return radius === undefined
            ? { text: 'no radius undercuts this ring' }
            : { value: radius, text: 'ring tips are undercut from' };
        },
      }),
      variant('/drive/teeth', 'shape', 'Shape', [
        { value: 'cylinder', label: 'Cylinders', implied: true, fields: [WIDTH] },
        {
          value: 'ball',
          label: 'Balls',
          fields: [groove('wave_generator', 'Groove of the wave generator'), groove('ring', 'Groove of the ring'), groove('carrier', 'Groove of the slots')],
        },
        {
          value: 'flat_sided',
          label: 'Cylinders with flats',
          fields: [
            WIDTH,
            number('/drive/teeth/flat_length_mm', 'Length of the flats', 'l', 'mm', {
              slider: WIDE,
              likely: 4,
              start: (design) => Number((0.8 * (at(design, '/drive/teeth/radius_mm') ?? 5)).toPrecision(6)),
            }),
          ],
        },
      ], { name: 'Teeth', adjust: withLaw }),
      whole('/drive/teeth/count', 'Slots in theory', 'Z_G', { step: 2, likely: 28, terms: ['slots'] }),
      whole('/drive/teeth/installed', 'Teeth installed', 'Z′_G', {
        step: 2,
        optional: (design) => `all ${at(design, '/drive/teeth/count') ?? ''}`,
      }),
    ],
  },
  {
    title: 'Ring',
    pointer: '/drive/ring',
    open: true,
    fields: [
      whole('/drive/ring/teeth', 'Ring teeth', 'Z_K', { step: 2, likely: 26 }),
      number('/drive/ring/tip_radius_mm', 'Bored tip radius', 'R_b', 'mm', {
        slider: 0.01,
        optional: (_, answers) => {
          const radius = answers.geometry?.ring.tip_radius_mm;
          return radius === undefined ? 'natural' : `natural ${Number(radius.toPrecision(3))}`;
        },
      }),
    ],
  },
  {
    title: 'Load',
    pointer: '/load',
    open: true,
    fields: [
      {
        kind: 'oneOf',
        pointer: '/load',
        name: 'Torque',
        label: 'Torque given at the',
        options: [
          {
            key: 'input_torque_nm',
            label: 'wave generator (input)',
            preset: 20,
            field: number('/load/input_torque_nm', 'Input torque', 'M_0', 'N·m', { slider: 0.95 }),
          },
          {
            key: 'output_torque_nm',
            label: 'carrier (output)',
            preset: 280,
            field: number('/load/output_torque_nm', 'Output torque', 'M_G', 'N·m', { slider: 0.95 }),
          },
          {
            key: 'duty',
            label: 'wave generator, several loads in turn',
            preset: [{ input_torque_nm: 20, input_speed_rpm: USUAL_SPEED_RPM, share_of_time: 1 }],
            field: {
              kind: 'lines',
              pointer: '/load/duty',
              label: 'Duty, a load on each line',
              columns: [
                { key: 'input_torque_nm', others: ['output_torque_nm'], unit: 'N·m' },
                { key: 'input_speed_rpm', unit: '1/min' },
                { key: 'share_of_time', unit: '%', factor: 100 },
              ],
            },
          },
        ],
        // The same load seen from the other shaft, so that switching changes no result; of a duty its hardest.
        convert: (from, value, to, answers, design) => {
          const { load } = answers.sweep ?? {};
          if (to === 'duty') {
            const torque = load?.[from] === value ? load.input_torque_nm : undefined;
            return torque && [{ input_torque_nm: torque, input_speed_rpm: at(design, '/load/input_speed_rpm') ?? USUAL_SPEED_RPM, share_of_time: 1 }];
          }
          return from === 'duty' || load?.[from] === value ? load?.[to] : undefined;
        },
        adjust: withDuty,
      },
      number('/load/input_speed_rpm', 'Input speed', 'n', '1/min', {
        slider: WIDE,
        optional: () => 'not given',
        likely: USUAL_SPEED_RPM,
        when: (design) => at(design, '/load/duty') === undefined,
      }),
      unlessSaid('/load/cycle', 'Load on the carrier’s fingers', [
        { value: 'pulsating', label: 'pulsating: one sense of the torque' },
        { value: 'reversed', label: 'reversed: both senses' },
      ]),
      number('/load/allowable_stress_mpa', 'Allowable stress', 'σ', 'MPa', { slider: WIDE, optional: (design) => (at(design, '/load/allowable_stress_mpa') === undefined ? 'not asked' : 'by contact') }),
    ],
  },
  {
    title: 'Model',
    pointer: '/model',
    open: true,
    fields: [
      choice(
        '/model/compatibility',
        'Compatibility',
        [
          { value: 'projection', label: 'As in the paper (projection)', suits: (design) => !isBall(design) || lawOf(design) === 'fixed' },
          { value: 'virtual_work', label: 'Virtual work' },
        ],
        { terms: ['projection', 'virtual_work', 'paper'], otherwise: compatibilityOf, adjust: withProjectedLaw },
      ),
      variant('/model/stiffness', 'law', 'Contact law', [
        { value: 'linear', label: 'Linear, from the materials', fields: [], suits: (design) => !isBall(design) },
        { value: 'palmgren', label: 'Palmgren, steel on steel', fields: [], suits: (design) => !isBall(design) },
        {
          value: 'johnson',
          label: 'Johnson, logarithmic',
          fields: [depth('wave_generator', 'Depth in the wave generator'), depth('ring', 'Depth in the ring'), depth('carrier', 'Depth in the carrier')],
          suits: (design) => !isBall(design),
        },
        { value: 'hertz', label: 'Hertz, of balls', fields: [], suits: isBall },
        {
          value: 'fixed',
          label: 'Fixed stiffnesses',
          fields: [stiffness('wave_generator', 'At the wave generator', 'k_H'), stiffness('ring', 'At the ring', 'k_K'), stiffness('carrier', 'At the carrier', 'k_S')],
        },
      ], { otherwise: lawOf, adjust: withLaw }),
      clearance('wave_generator', 'Clearance of the wave generator'),
      clearance('ring', 'Clearance of the ring'),
      clearance('carrier', 'Clearance of each slot wall'),
      clearance('teeth', 'Clearance of the teeth in radius'),
    ],
  },
  {
    title: 'Friction and wear',
    pointer: '/friction',
    hint: 'Friction gives the efficiency. With an input speed it also gives the power lost, and with wear rates the wear in µm/h.',
    summary: (design) => ({ plain: 'plain cam', race: 'race on a bearing', rolling: 'rolling' })[at(design, '/friction/wave_generator/kind')] ?? 'not computed',
    fields: [
      variant('/friction/wave_generator', 'kind', 'The teeth run on', [
        { value: 'none', label: 'friction is not computed', implied: true, fields: [] },
        { value: 'plain', label: 'the cam itself', fields: [RUBBING, ...ELSEWHERE] },
        { value: 'race', label: 'a race on a bearing', fields: [RUBBING, ...BEARING, ...ELSEWHERE, ...BEARING_LIFE] },
        { value: 'rolling', label: 'a race that does not rub on them', fields: [...BEARING, ...ELSEWHERE, ...BEARING_LIFE] },
      ], { name: 'Friction', adjust: withFriction, terms: ['race', 'wear'] }),
    ],
  },
  {
    title: 'Compliance of the supports',
    pointer: '/model/series_compliance_mm_per_n',
    hint: 'Added to the contacts themselves, such as that of a bearing under the cam. Only virtual work takes it.',
    summary: (design) => {
      const series = at(design, '/model/series_compliance_mm_per_n') ?? {};
      return series === 'estimated' ? series : Object.values(series).some((value) => value) ? 'given' : 'nothing';
    },
    fields: [
      compliance('wave_generator', 'Compliance, wave generator'), compliance('ring', 'Compliance, ring'), compliance('carrier', 'Compliance, carrier'),
      choice('/model/refinements', 'Refinements', [
        { value: '', label: 'by the geometry' },
        { value: 'none', label: 'none' },
        { value: ['auto', 'corner_contact'], label: 'by the geometry, and teeth meet the corners of tips' },
        { value: ['ring_teeth_bend'], label: 'the ring’s teeth bend' },
        { value: ['wave_generator_moves'], label: 'the wave generator moves on' },
        { value: ['ring_teeth_bend', 'wave_generator_moves'], label: 'the ring’s teeth bend, the wave generator moves on' },
        { value: ['ring_teeth_bend', 'wave_generator_moves', 'corner_contact'], label: 'all three' },
      ]),
    ],
  },
  {
    title: 'Modification',
    pointer: '/modification',
    hint: 'Deliberate changes, alike for all teeth. A positive value opens clearance; a negative value needs clearance elsewhere: the clearances of the parts. Only virtual work takes it.',
    summary: (design) => (isGiven(at(design, '/modification')) ? 'given' : 'none'),
    fields: [
      modified('ring_equidistant_um', 'Ring set back', 'Δ_K'),
      modified('ring_path_shift_um', 'Ring’s path outward', 'Δ_d'),
      modified('ring_profile_shift_um', 'Ring’s profile outward', 'Δ_R'),
      turned('ring', 'Ring’s flanks turned away', 'θ_K'),
      flag(RELIEF, 'Tip relief of the ring', { starts: reliefOf, adjust: withVirtualWork }),
      number(`${RELIEF}/amount_um`, 'Relief at the tip', 'C', 'µm', { of: 'Tip relief', when: hasRelief, likely: 5, step: 1 }),
      number(`${RELIEF}/start_deg`, 'from the position', 'ψ_t', 'deg', { of: 'Tip relief', when: hasRelief, likely: 60, step: 1 }),
      number(`${RELIEF}/power`, 'to the power', 'n', '', { of: 'Tip relief', when: hasRelief, likely: 2, step: 0.5 }),
      modified('wave_generator_equidistant_um', 'Wave generator set back', 'Δ_H'),
      modified('slot_wall_um', 'Slot walls set back', 'Δ_S'),
      turned('carrier', 'Carrier turned away', 'θ_S'),
      modified('tooth_radius_um', 'Teeth thinner in radius', 'Δ_r'),
    ],
  },
  {
    title: 'Runout',
    pointer: '/deviations',
    hint: 'Directions are fixed in the part. Measured deviations of single teeth, slots, spaces and lobes are lists in the JSON.',
    summary: (design) => {
      const lists = Object.values(at(design, '/deviations') ?? {}).filter((value) => Array.isArray(value) && value.length > 0).length;
      const own = isGiven(at(design, '/deviations')) ? 'given' : 'none';
      return lists > 0 ? `${lists} list${lists > 1 ? 's' : ''} in the JSON` : own;
    },
    fields: [...runout('wave_generator', 'Runout of the wave generator'), ...runout('ring', 'Runout of the ring'), ...runout('carrier', 'Runout of the carrier')],
  },
  {
    title: 'Materials',
    pointer: '/materials',
    summary: (design) => {
      const moduli = ['wave_generator', 'teeth', 'ring', 'carrier'].map(
        (part) => at(design, `/materials/${part}/youngs_modulus_gpa`) ?? 210,
      );
      return moduli.every((modulus) => modulus === moduli[0]) ? `all ${moduli[0]} GPa` : moduli.join(' · ') + ' GPa';
    },
    parts: [
      material('wave_generator', 'Wave generator'),
      material('teeth', 'Teeth'),
      material('ring', 'Ring'),
      material('carrier', 'Carrier'),
    ],
  },
  {
    title: 'Parts as they are made',
    pointer: '/parts',
    hint: 'Drawings, the strength of the carrier’s fingers and the estimates of what gives way behind the contacts depend on these; forces on flat-sided teeth depend on the carrier’s radii too.',
    summary: (design) => {
      const given = Object.values(at(design, '/parts') ?? {}).flatMap((part) => Object.values(part ?? {})).filter((value) => value !== null);
      return given.length === 0 ? 'defaults' : `${given.length} given`;
    },
    parts: [
      {
        title: 'Wave generator',
        fields: [
          freeRadius('wave_generator', 'Wave generator', 'bore_radius', 'Bore radius', 'R_i', 'no bore'),
        ],
      },
      {
        title: 'Ring',
        fields: [
          freeRadius('ring', 'Ring', 'outer_radius', 'Outer radius', 'R_o', '1.2 × root'),
          unlessSaid('/parts/ring/rim', 'Around its rim', [
            { value: 'housed', label: 'a rigid housing' },
            { value: 'free', label: 'nothing' },
          ]),
        ],
      },
      {
        title: 'Carrier',
        hint: 'By default a tenth of the annulus between cam and ring tips stays free on either side.',
        fields: [
          freeRadius('carrier', 'Carrier', 'inner_radius', 'Inner radius', 'R_i', 'tenth free'),
          freeRadius('carrier', 'Carrier', 'outer_radius', 'Outer radius', 'R_o', 'tenth free'),
          unlessSaid('/parts/carrier/fingers', 'Its fingers are held', [
            { value: 'held_at_both_ends', label: 'at both ends' },
            { value: 'far_ends_joined', label: 'at one end, far ends joined by a ring' },
            { value: 'held_at_one_end', label: 'at one end' },
            { value: 'web_in_the_middle', label: 'by a web in the middle' },
          ]),
          number('/parts/carrier/finger_fillet_radius_mm', 'Fillet at their feet', 'r_f', 'mm', { optional: () => 'tenth of thickness', step: 0.1 }),
          unlessSaid('/parts/carrier/strength', 'Strength of its material', STRENGTHS),
        ],
      },
    ],
  },
  {
    title: 'Sweep and profile',
    pointer: '/sweep',
    summary: (design) => {
      const tolerance = at(design, '/sweep/tolerance');
      return tolerance === undefined ? `${at(design, '/sweep/samples') ?? 50} samples` : `to ${tolerance}`;
    },
    fields: [
      {
        kind: 'oneOf',
        pointer: '/sweep',
        name: 'Sweep',
        label: 'Input angles',
        options: [
          { key: 'samples', label: 'equally spaced', preset: 50, field: whole('/sweep/samples', 'Samples of a period', 'N', { preset: 50 }) },
          { key: 'tolerance', label: 'where the true peaks need them', preset: 1e-6, field: number('/sweep/tolerance', 'Relative tolerance', 'τ', '') },
        ],
      },
      flag('/sweep/wind_up', 'Wind-up, torsional stiffness and backlash too'),
      number('/profile/chord_tolerance_mm', 'Chord tolerance', 't', 'mm', { preset: 0.001, step: 0.001 }),
      choice('/profile/extent', 'Exported ring profile', [
        { value: 'tooth', label: 'One tooth' },
        { value: 'full', label: 'The whole ring' },
      ]),
    ],
  },
];

/** Every field that can stand in the form, with the group that holds it. */
export function fieldsOf(group) {
  const found = new Map();
  const add = (field) => {
    if (!found.has(field.pointer)) found.set(field.pointer, field);
    for (const option of field.options ?? []) for (const inner of option.fields ?? (option.field ? [option.field] : [])) add(inner);
  };
  for (const part of group.parts ?? [group]) part.fields.forEach(add);
  return [...found.values()];
}

/** Whether a document says what a flag stands for. */
export const isOn = ({ pointer, starts }, design) => (starts ? typeof at(design, pointer) === 'object' && at(design, pointer) !== null : at(design, pointer) === true);

/** The kind of a variant that a document has: the implied or first one where it has no tag, undefined where it has another. */
export function kindOf({ pointer, tag, options, otherwise }, design) {
  const given = at(design, pointer)?.[tag];
  if (given === undefined || given === null) return otherwise?.(design) ?? (options.find(({ implied }) => implied) ?? options[0]).value;
  return options.find(({ value }) => value === given)?.value;
}

/** The value of a variant when another kind is chosen: what does not belong to a kind stays, with the fields that both kinds have. */
export function keptBy({ pointer, tag, options }, kind, design) {
  const chosen = options.find(({ value }) => value === kind);
  // Of what stands deeper within, the object that holds it; what stands beside the variant is not its own.
  const keyOf = (field) => field.pointer.slice(pointer.length + 1).split('/')[0];
  const within = (fields) => fields.filter((field) => field.pointer.startsWith(`${pointer}/`));
  const own = new Map(within(chosen.fields).map((field) => [keyOf(field), field]));
  const others = new Set(within(options.flatMap(({ fields }) => fields)).map(keyOf).filter((key) => !own.has(key)));
  const kept = Object.entries(at(design, pointer) ?? {}).filter(([key]) => key !== tag && !others.has(key));
  const given = new Set(kept.map(([key]) => key));
  const starts = [...own].filter(([key, { start }]) => start !== undefined && !given.has(key)).map(([key, { start }]) => [key, typeof start === 'function' ? start(design) : start]);
  return { ...(chosen.implied ? {} : { [tag]: kind }), ...Object.fromEntries([...kept, ...starts]) };
}

/** A field's label where it stands without its group. */
export const fullLabel = ({ label, of }) => (of ? `${label}, ${of.toLowerCase()}` : label);

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
