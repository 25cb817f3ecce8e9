// The design document: which fields the form shows, in the document's own groups. A field that the service learns to read
// is one entry here; nothing else in the page knows field names except what is drawn from them.
//
// What comes in several kinds, as a wave generator does, is a `variant`: its tag is chosen, and of all the fields only those of the
// chosen kind are shown. A kind may be `implied`: it is meant where the document has no tag, and then none is written. A kind's field
// starts with its `preset`, a value or what makes one of the design, where the document has none.

/** Shares of the value on either side that a slider spans. */
const NARROW = 0.05;
const WIDE = 0.75;

const number = (pointer, label, symbol, unit, more) => ({ kind: 'number', pointer, label, symbol, unit, ...more });
const whole = (pointer, label, symbol, more) => ({ kind: 'number', whole: true, pointer, label, symbol, ...more });
const choice = (pointer, label, options, more) => ({ kind: 'choice', pointer, label, options, ...more });
const flag = (pointer, label) => ({ kind: 'flag', pointer, label });
const variant = (pointer, tag, label, options, more) => ({ kind: 'variant', pointer, tag, label, options, ...more });

/** A gap at a contact; without any, the document has no clearance at all. */
const clearance = (contact, label, symbol) =>
  number(`/model/clearance/${contact}_um`, label, symbol, 'µm', { slider: WIDE, optional: () => 'none', step: 1 });

/** Steel, as the service fills in what a document leaves out. */
const material = (part, label) => ({
  title: label,
  fields: [
    number(`/materials/${part}/youngs_modulus_gpa`, 'Young’s modulus', 'E', 'GPa', { preset: 210, of: label }),
    number(`/materials/${part}/poissons_ratio`, 'Poisson’s ratio', 'ν', '', { preset: 0.3, of: label, step: 0.01 }),
  ],
});

/** How far a part as it is made is set back from the one that the mechanics know. */
const setBack = (part, label, what) =>
  number(`/parts/${part}/clearance_um`, what, '', 'µm', { of: label, optional: () => '0', step: 1 });

/** A radius that the mechanics leave free, with what is taken where it is left out. */
const freeRadius = (part, label, key, what, otherwise) => number(`/parts/${part}/${key}_mm`, what, '', 'mm', { of: label, optional: () => otherwise });

/** Lobes of the wave generator: as many teeth the carrier has more or fewer than the ring. */
const LOBES = 2;

/** The document with the counts that a ratio of input to output speed asks for, ring fixed: of the slots as many hold a tooth as
 *  before, all or every second and so on, where that is possible. */
function withRatio(design, ratio) {
  const { count, installed } = design.drive?.teeth ?? {};
  const next = LOBES * Math.abs(ratio);
  const counted = changed(changed(design, '/drive/teeth/count', next), '/drive/ring/teeth', next - LOBES * Math.sign(ratio));
  if (typeof installed !== 'number') return counted;
  let left = Math.max(1, Math.round(count / installed));
  while (next % (LOBES * left) !== 0) left -= 1;
  return changed(counted, '/drive/teeth/installed', next / left);
}

const ratio = {
  ...whole('/ratio', 'Ratio, ring fixed', 'i_HG'),
  derived: { read: ({ geometry }) => geometry?.transmission_ratio, write: withRatio },
  refuses: (value) => (Number.isInteger(value) && Math.abs(value) >= 2 ? undefined : 'A ratio is a whole number, 2 or more; negative where the carrier turns against the input. The last one stands.'),
  next: (value, sense) => (value + sense > -2 && value + sense < 2 ? 2 * sense : value + sense),
};

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
            number('/drive/wave_generator/semi_major_mm', 'Semi-major axis', 'a', 'mm', { slider: NARROW, likely: 58 }),
            number('/drive/wave_generator/semi_minor_mm', 'Semi-minor axis', 'b', 'mm', { slider: NARROW, likely: 56 }),
          ],
        },
      ], { name: 'Wave generator' }),
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
            ? { text: 'no radius undercuts this ellipse' }
            : { value: radius, text: 'ring tips are undercut from' };
        },
      }),
      variant('/drive/teeth', 'shape', 'Shape', [
        { value: 'cylinder', label: 'Cylinders', implied: true, fields: [number('/drive/teeth/width_mm', 'Tooth width', 'L_1', 'mm', { slider: WIDE, likely: 15 })] },
      ], { name: 'Teeth' }),
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
      number('/drive/ring/tip_radius_mm', 'Bored tip radius', '', 'mm', {
        slider: 0.01,
        optional: (_, answers) => {
          const radius = answers.geometry?.ring.tip_radius_mm;
          return radius === undefined ? 'natural' : `natural ${radius.toFixed(2)}`;
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
        ],
        // The same load seen from the other shaft, so that switching changes no result.
        convert: (from, value, to, answers) => (answers.sweep?.load[from] === value ? answers.sweep.load[to] : undefined),
      },
      number('/load/allowable_stress_mpa', 'Allowable stress', 'σ', 'MPa', { slider: WIDE, optional: () => 'not asked' }),
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
          { value: 'projection', label: 'Projection (the paper’s)' },
          { value: 'virtual_work', label: 'Virtual work' },
        ],
        { terms: ['projection', 'virtual_work', 'paper'] },
      ),
      variant('/model/stiffness', 'law', 'Contact law', [
        { value: 'linear', label: 'Linear, from the materials', fields: [] },
        { value: 'palmgren', label: 'Palmgren, steel on steel', fields: [] },
        {
          value: 'fixed',
          label: 'Fixed stiffnesses',
          fields: [
            number('/model/stiffness/wave_generator_n_per_mm', 'At the wave generator', 'k_H', 'N/mm', { preset: 500000 }),
            number('/model/stiffness/ring_n_per_mm', 'At the ring', 'k_K', 'N/mm', { preset: 500000 }),
            number('/model/stiffness/carrier_n_per_mm', 'At the carrier', 'k_S', 'N/mm', { preset: 500000 }),
          ],
        },
      ]),
      clearance('wave_generator', 'Gap at the wave generator', ''),
      clearance('ring', 'Gap at the ring', ''),
      clearance('carrier', 'Gap at the carrier', ''),
    ],
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
    hint: 'Only drawings read these: forces are computed with the gaps of the model. The gap at a contact is the sum of its two parts’ clearances.',
    summary: (design) => {
      const given = Object.values(at(design, '/parts') ?? {}).flatMap((part) => Object.values(part ?? {})).filter((value) => value !== null);
      return given.length === 0 ? 'defaults' : `${given.length} given`;
    },
    parts: [
      {
        title: 'Wave generator',
        fields: [
          freeRadius('wave_generator', 'Wave generator', 'bore_radius', 'Bore radius', 'no bore'),
          setBack('wave_generator', 'Wave generator', 'Clearance inward'),
        ],
      },
      { title: 'Teeth', fields: [setBack('teeth', 'Teeth', 'Clearance in radius')] },
      {
        title: 'Ring',
        fields: [freeRadius('ring', 'Ring', 'outer_radius', 'Outer radius', '1.2 × root'), setBack('ring', 'Ring', 'Clearance outward')],
      },
      {
        title: 'Carrier',
        hint: 'By default a tenth of the annulus between cam and ring tips stays free on either side.',
        fields: [
          freeRadius('carrier', 'Carrier', 'inner_radius', 'Inner radius', 'tenth free'),
          freeRadius('carrier', 'Carrier', 'outer_radius', 'Outer radius', 'tenth free'),
          setBack('carrier', 'Carrier', 'Clearance per wall'),
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
          { key: 'tolerance', label: 'where the true peaks need them', preset: 1e-6, field: number('/sweep/tolerance', 'Relative tolerance', '', '') },
        ],
      },
      flag('/sweep/wind_up', 'Wind-up and torsional stiffness too'),
      number('/profile/chord_tolerance_mm', 'Chord tolerance', '', 'mm', { preset: 0.001, step: 0.001 }),
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

/** The kind of a variant that a document has: the implied or first one where it has no tag, undefined where it has another. */
export function kindOf({ pointer, tag, options }, design) {
  const given = at(design, pointer)?.[tag];
  if (given === undefined || given === null) return (options.find(({ implied }) => implied) ?? options[0]).value;
  return options.find(({ value }) => value === given)?.value;
}

/** The value of a variant when another kind is chosen: what does not belong to a kind stays, with the fields that both kinds have. */
export function keptBy({ pointer, tag, options }, kind, design) {
  const chosen = options.find(({ value }) => value === kind);
  const keyOf = (field) => field.pointer.split('/').at(-1);
  const own = new Map(chosen.fields.map((field) => [keyOf(field), field]));
  const others = new Set(options.flatMap(({ fields }) => fields).map(keyOf).filter((key) => !own.has(key)));
  const kept = Object.entries(at(design, pointer) ?? {}).filter(([key]) => key !== tag && !others.has(key));
  const given = new Set(kept.map(([key]) => key));
  const presets = [...own].filter(([key, { preset }]) => preset !== undefined && !given.has(key)).map(([key, { preset }]) => [key, typeof preset === 'function' ? preset(design) : preset]);
  return { ...(chosen.implied ? {} : { [tag]: kind }), ...Object.fromEntries([...kept, ...presets]) };
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
  const copy = { ...design };
  const inner = rest.length === 0 ? value : changed(design?.[key] ?? {}, `/${rest.join('/')}`, value);
  const isEmptied = value === undefined && rest.length > 0 && Object.keys(inner).length === 0;
  if (inner === undefined || isEmptied) delete copy[key];
  else copy[key] = inner;
  return copy;
}

export const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);
