// The fields of the design's form, in the document's own groups. A field that the service learns to read is one entry here, with its texts;
// nothing else in the page knows field names except what is drawn from them.

import {
  USUAL_FRICTION, USUAL_SPEED_RPM, at, compatibilityOf, estimatesOf, isBall, isEstimated, isGiven, lawOf, lobesOf, ratioOf, sizeOf, withDuty, withFriction, withLaw,
  withOtherEstimates, withProjectedLaw, withRatio, withRing, withVirtualWork,
} from './design.js';
import { choice, fieldsOf, flag, group, lines, number, oneOf, unlessSaid, variant, whole } from './field.js';
import { number as format, withUnit } from './format.js';
import { STRENGTHS } from './strengths.js';
import { counted, t, textOf } from './texts.js';

/** Shares of the value on either side that a slider spans. */
const NARROW = 0.05;
const WIDE = 0.75;

/** How far a part is set back from the one without gaps: drawn, and open at its contact until the load closes it. */
const clearance = (part, symbol) => number(`/parts/${part}/clearance_um`, symbol, 'µm', { slider: WIDE, optional: () => t('empty.none'), step: 1 });

/** How many of its own fields a document gives other than 0; `none` where there are none. */
const givenCount = (none) => (design, group) => {
  const count = fieldsOf(group).filter(({ pointer }) => at(design, pointer)).length;
  return count === 0 ? t(`summary.${none}`) : t('summary.given_count', { count });
};

/** At each contact the clearance of both parts, with what `modification` sets back along normals; its shifts and turns vary along the flank. */
function clearancesInWords(design) {
  const sum = (...pointers) => withUnit(format(pointers.reduce((total, pointer) => total + (at(design, pointer) ?? 0), 0)), 'µm');
  const contact = (part, modification) => sum(`/parts/${part}/clearance_um`, '/parts/teeth/clearance_um', `/modification/${modification}`, '/modification/tooth_radius_um');
  const [wave_generator, ring, carrier] = [contact('wave_generator', 'wave_generator_equidistant_um'), contact('ring', 'ring_equidistant_um'), contact('carrier', 'slot_wall_um')];
  return t('form.clearances', { wave_generator, ring, carrier });
}

/** Steel, as the service fills in what a document leaves out. */
const material = (part) => {
  const title = t(`part.${part}`);
  return {
    title,
    part,
    fields: [
      number(`/materials/${part}/youngs_modulus_gpa`, 'E', 'GPa', { label: t('label.youngs_modulus'), preset: 210, of: title }),
      number(`/materials/${part}/poissons_ratio`, 'ν', '', { label: t('label.poissons_ratio'), preset: 0.3, of: title, step: 0.01 }),
    ],
  };
};

/** A radius that the mechanics leave free, with what is taken where it is left out. */
const freeRadius = (part, key, symbol, otherwise) => number(`/parts/${part}/${key}_mm`, symbol, 'mm', { of: t(`part.${part}`), optional: () => t(`empty.${otherwise}`) });

const ratio = {
  ...whole('/ratio', 'i_HG'),
  derived: { read: ratioOf, write: withRatio },
  offersSearch: true,
  refuses: (value, design) => {
    const lobes = lobesOf(design);
    const others = lobes > 1 ? t('fault.ratio_others', { lobes }) : '';
    const isWhole = Math.abs(lobes * value - Math.round(lobes * value)) < 0.005;
    return isWhole && Math.abs(value) >= 2 ? undefined : t('fault.ratio', { others });
  },
  next: (value, sense) => (value + sense > -2 && value + sense < 2 ? 2 * sense : value + sense),
};

/** With one lobe a harmonic support is an eccentric. */
const SUPPORT_LOBES = whole('/drive/wave_generator/lobes', 'U', { likely: 2, start: (design) => Math.max(2, lobesOf(design)), adjust: withRing });
const LOBES = whole('/drive/wave_generator/lobes', 'U', { likely: 2, start: lobesOf, adjust: withRing });
const AMPLITUDE = number('/drive/wave_generator/amplitude_mm', 'e', 'mm', { slider: WIDE, likely: 1, start: (design) => sizeOf(design).stroke });
const WIDTH = number('/drive/teeth/width_mm', 'L_1', 'mm', { slider: WIDE, likely: 15, start: (design) => 3 * (at(design, '/drive/teeth/radius_mm') ?? 5) });

/** Across the path; without one the part is straight there. */
const groove = (contact) => number(`/drive/teeth/groove_radius_mm/${contact}`, 'r_g', 'mm', { slider: 0.05, optional: () => t('empty.no_groove'), step: 0.1 });

/** How far below a contact its body stands still. */
const depth = (contact) =>
  number(`/model/stiffness/depth_mm/${contact}`, 'd', 'mm', { optional: (design) => `r = ${at(design, '/drive/teeth/radius_mm') ?? ''}`, step: 0.5 });

const stiffness = (contact, symbol) => number(`/model/stiffness/${contact}_n_per_mm`, symbol, 'N/mm', { start: 500000, likely: 500000 });

const compliance = (contact) =>
  number(`/model/series_compliance_mm_per_n/${contact}`, '1/k', 'mm/N', {
    optional: (design, answers) => (isEstimated(design) && estimatesOf(answers)[contact]) || '0',
    likely: 1e-6,
    adjust: withOtherEstimates,
  });

const modified = (key, symbol, more) => number(`/modification/${key}`, symbol, 'µm', { optional: () => '0', step: 1, adjust: withVirtualWork, ...more });
const turned = (part, symbol) => modified(`${part}_rotation_arcsec`, symbol, { unit: '″' });

const RELIEF = '/modification/ring_tip_relief';
const hasRelief = (design) => at(design, RELIEF) !== undefined;
/** It begins within the mesh, whatever the number of lobes. */
const reliefOf = (_, { geometry }) => ({ amount_um: 5, start_deg: Math.floor((2 / 3) * (geometry?.engagement.start_deg ?? 90)), power: 2 });

/** A part off the axis. */
const runout = (part) => [
  number(`/deviations/${part}_runout/amount_um`, 'e', 'µm', { optional: () => '0', step: 1, adjust: withVirtualWork }),
  number(`/deviations/${part}_runout/angle_deg`, 'α', 'deg', { of: t(`label./deviations/${part}_runout/amount_um`), optional: () => '0', step: 5, adjust: withVirtualWork }),
];

const RUBBING = number('/friction/wave_generator/coefficient', 'μ_H', '', { slider: WIDE, likely: 0.05, start: USUAL_FRICTION.coefficient, step: 0.005 });
const BEARING = [
  number('/friction/wave_generator/bearing_coefficient', 'μ_b', '', { slider: WIDE, likely: 0.002, start: USUAL_FRICTION.bearing, step: 0.0005 }),
  number('/friction/wave_generator/bearing_radius_mm', 'R_b', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
];
const BEARING_LIFE = [
  number('/friction/wave_generator/bearing_load_rating_n', 'C', 'N', { optional: () => t('empty.no_life'), likely: 9000, step: 100 }),
  choice('/friction/wave_generator/bearing_element', [{ value: 'ball' }, { value: 'roller' }]),
];
const wearRate = (contact) =>
  number(`/friction/wear_rate_mm3_per_nm/${contact}`, 'w', 'mm³/(N·m)', { optional: () => '0', likely: 1e-8 });
const ELSEWHERE = [
  number('/friction/ring/coefficient', 'μ_K', '', { slider: WIDE, likely: 0.05, step: 0.005 }),
  number('/friction/carrier/coefficient', 'μ_S', '', { slider: WIDE, likely: 0.05, step: 0.005 }),
  wearRate('wave_generator'),
  wearRate('ring'),
  wearRate('carrier'),
];

/** The same load seen from the other shaft, so that switching changes no result; of a duty its hardest. */
function sameLoad(from, value, to, answers, design) {
  const { load } = answers.sweep ?? {};
  if (to === 'duty') {
    const torque = load?.[from] === value ? load.input_torque_nm : undefined;
    return torque && [{ input_torque_nm: torque, input_speed_rpm: at(design, '/load/input_speed_rpm') ?? USUAL_SPEED_RPM, share_of_time: 1 }];
  }
  return from === 'duty' || load?.[from] === value ? load?.[to] : undefined;
}

export const GROUPS = [
  {
    ...group('/drive/wave_generator'),
    open: true,
    fields: [
      variant('/drive/wave_generator', 'kind', [
        {
          value: 'ellipse',
          implied: true,
          fields: [
            number('/drive/wave_generator/semi_major_mm', 'a', 'mm', { slider: NARROW, likely: 58, start: (design) => sizeOf(design).high }),
            number('/drive/wave_generator/semi_minor_mm', 'b', 'mm', { slider: NARROW, likely: 56, start: (design) => sizeOf(design).low }),
          ],
        },
        {
          value: 'eccentric',
          fields: [
            number('/drive/wave_generator/radius_mm', 'R_0', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
            number('/drive/wave_generator/eccentricity_mm', 'e', 'mm', { slider: WIDE, likely: 1, start: (design) => sizeOf(design).stroke }),
          ],
        },
        {
          value: 'harmonic',
          fields: [
            SUPPORT_LOBES,
            number('/drive/wave_generator/mean_radius_mm', 'R_0', 'mm', { slider: NARROW, likely: 57, start: (design) => sizeOf(design).mean }),
            AMPLITUDE,
          ],
        },
        {
          value: 'harmonic_path',
          fields: [
            LOBES,
            number('/drive/wave_generator/mean_path_radius_mm', 'R', 'mm', { slider: NARROW, likely: 62, start: (design) => sizeOf(design).path }),
            AMPLITUDE,
          ],
        },
      ], { adjust: withRing, terms: ['lobes'] }),
    ],
  },
  {
    ...group('/drive/teeth'),
    open: true,
    fields: [
      ratio,
      number('/drive/teeth/radius_mm', 'r', 'mm', {
        slider: WIDE,
        likely: 5,
        mark: (answers) => {
          const radius = answers.geometry?.undercut.critical_tooth_radius_mm;
          return radius === undefined
            ? { text: t('mark.no_undercut') }
            : { value: radius, text: t('mark.undercut') };
        },
      }),
      variant('/drive/teeth', 'shape', [
        { value: 'cylinder', implied: true, fields: [WIDTH] },
        {
          value: 'ball',
          fields: [groove('wave_generator'), groove('ring'), groove('carrier')],
        },
        {
          value: 'flat_sided',
          fields: [
            WIDTH,
            number('/drive/teeth/flat_length_mm', 'l', 'mm', {
              slider: WIDE,
              likely: 4,
              start: (design) => Number((0.8 * (at(design, '/drive/teeth/radius_mm') ?? 5)).toPrecision(6)),
            }),
          ],
        },
      ], { adjust: withLaw }),
      whole('/drive/teeth/count', 'Z_G', { step: 2, likely: 28, terms: ['slots'] }),
      whole('/drive/teeth/installed', 'Z′_G', {
        step: 2,
        optional: (design) => t('empty.all', { count: at(design, '/drive/teeth/count') }),
      }),
    ],
  },
  {
    ...group('/drive/ring'),
    open: true,
    fields: [
      whole('/drive/ring/teeth', 'Z_K', { step: 2, likely: 26 }),
      number('/drive/ring/tip_radius_mm', 'R_b', 'mm', {
        slider: 0.01,
        optional: (_, answers) => {
          const radius = answers.geometry?.ring.tip_radius_mm;
          return t('empty.natural', { radius: radius && Number(radius.toPrecision(3)) }).trim();
        },
      }),
    ],
  },
  {
    ...group('/load'),
    open: true,
    fields: [
      oneOf('/load', [
        { key: 'input_torque_nm', preset: 20, field: number('/load/input_torque_nm', 'M_0', 'N·m', { slider: 0.95 }) },
        { key: 'output_torque_nm', preset: 280, field: number('/load/output_torque_nm', 'M_G', 'N·m', { slider: 0.95 }) },
        {
          key: 'duty',
          preset: [{ input_torque_nm: 20, input_speed_rpm: USUAL_SPEED_RPM, share_of_time: 1 }],
          field: lines('/load/duty', [
            { key: 'input_torque_nm', others: ['output_torque_nm'], unit: 'N·m' },
            { key: 'input_speed_rpm', unit: '1/min' },
            { key: 'share_of_time', unit: '%', factor: 100 },
          ]),
        },
      ], { convert: sameLoad, adjust: withDuty }),
      number('/load/input_speed_rpm', 'n', '1/min', {
        slider: WIDE,
        optional: () => t('empty.not_given'),
        likely: USUAL_SPEED_RPM,
        when: (design) => at(design, '/load/duty') === undefined,
      }),
      unlessSaid('/load/cycle', [{ value: 'pulsating' }, { value: 'reversed' }]),
      number('/load/allowable_stress_mpa', 'σ', 'MPa', { slider: WIDE, optional: (design) => (at(design, '/load/allowable_stress_mpa') === undefined ? t('empty.not_asked') : t('empty.by_contact')) }),
    ],
  },
  {
    ...group('/model'),
    open: true,
    fields: [
      choice(
        '/model/compatibility',
        [
          { value: 'projection', suits: (design) => !isBall(design) || lawOf(design) === 'fixed' },
          { value: 'virtual_work' },
        ],
        { terms: ['projection', 'virtual_work', 'paper'], otherwise: compatibilityOf, adjust: withProjectedLaw },
      ),
      variant('/model/stiffness', 'law', [
        { value: 'linear', fields: [], suits: (design) => !isBall(design) },
        { value: 'palmgren', fields: [], suits: (design) => !isBall(design) },
        {
          value: 'johnson',
          fields: [depth('wave_generator'), depth('ring'), depth('carrier')],
          suits: (design) => !isBall(design),
        },
        { value: 'hertz', fields: [], suits: isBall },
        {
          value: 'fixed',
          fields: [stiffness('wave_generator', 'k_H'), stiffness('ring', 'k_K'), stiffness('carrier', 'k_S')],
        },
      ], { otherwise: lawOf, adjust: withLaw, othersSuit: (design) => !isBall(design) }),
    ],
  },
  {
    ...group('/clearances'),
    open: true,
    summary: givenCount('none'),
    told: clearancesInWords,
    fields: [clearance('wave_generator', 'c_H'), clearance('ring', 'c_K'), clearance('carrier', 'c_S'), clearance('teeth', 'c_r')],
  },
  {
    ...group('/friction'),
    summary: (design) => textOf(`summary.friction.${at(design, '/friction/wave_generator/kind')}`) ?? t('summary.friction.none'),
    fields: [
      variant('/friction/wave_generator', 'kind', [
        { value: 'none', implied: true, fields: [] },
        { value: 'plain', fields: [RUBBING, ...ELSEWHERE] },
        { value: 'race', fields: [RUBBING, ...BEARING, ...ELSEWHERE, ...BEARING_LIFE] },
        { value: 'rolling', fields: [...BEARING, ...ELSEWHERE, ...BEARING_LIFE] },
      ], { adjust: withFriction, terms: ['race', 'wear'] }),
    ],
  },
  {
    ...group('/model/series_compliance_mm_per_n'),
    summary: (design) => {
      if (isEstimated(design)) return t('summary.estimated');
      return isGiven(at(design, '/model/series_compliance_mm_per_n')) ? t('summary.given') : t('summary.nothing');
    },
    fields: [
      compliance('wave_generator'), compliance('ring'), compliance('carrier'),
      choice('/model/refinements', [
        { value: '', text: 'auto' },
        { value: 'none' },
        { value: ['auto', 'corner_contact'], text: 'auto_corner' },
        { value: ['ring_teeth_bend'], text: 'bend' },
        { value: ['wave_generator_moves'], text: 'moves' },
        { value: ['ring_teeth_bend', 'wave_generator_moves'], text: 'bend_moves' },
        { value: ['ring_teeth_bend', 'wave_generator_moves', 'corner_contact'], text: 'all' },
      ]),
    ],
  },
  {
    ...group('/modification'),
    summary: (design) => isGiven(at(design, '/modification')) ? t('summary.given') : t('summary.none'),
    fields: [
      modified('ring_equidistant_um', 'Δ_K'),
      modified('ring_path_shift_um', 'Δ_d'),
      modified('ring_profile_shift_um', 'Δ_R'),
      turned('ring', 'θ_K'),
      flag(RELIEF, { starts: reliefOf, adjust: withVirtualWork }),
      number(`${RELIEF}/amount_um`, 'C', 'µm', { of: t('name.tip_relief'), when: hasRelief, likely: 5, step: 1 }),
      number(`${RELIEF}/start_deg`, 'ψ_t', 'deg', { of: t('name.tip_relief'), when: hasRelief, likely: 60, step: 1 }),
      number(`${RELIEF}/power`, 'n', '', { of: t('name.tip_relief'), when: hasRelief, likely: 2, step: 0.5 }),
      modified('wave_generator_equidistant_um', 'Δ_H'),
      modified('slot_wall_um', 'Δ_S'),
      turned('carrier', 'θ_S'),
      modified('tooth_radius_um', 'Δ_r'),
    ],
  },
  {
    ...group('/deviations'),
    summary: (design) => {
      const lists = Object.values(at(design, '/deviations') ?? {}).filter((value) => Array.isArray(value) && value.length > 0).length;
            if (lists > 0) return counted('summary.lists', lists);
      return isGiven(at(design, '/deviations')) ? t('summary.given') : t('summary.none');
    },
    fields: [...runout('wave_generator'), ...runout('ring'), ...runout('carrier')],
  },
  {
    ...group('/materials'),
    summary: (design) => {
      const moduli = ['wave_generator', 'teeth', 'ring', 'carrier'].map(
        (part) => at(design, `/materials/${part}/youngs_modulus_gpa`) ?? 210,
      );
      return moduli.every((modulus) => modulus === moduli[0]) ? t('summary.all_modulus', { modulus: moduli[0] }) : `${moduli.join(' · ')} GPa`;
    },
    parts: [
      material('wave_generator'),
      material('teeth'),
      material('ring'),
      material('carrier'),
    ],
  },
  {
    ...group('/parts'),
    summary: givenCount('defaults'),
    parts: [
      {
        title: t('part.wave_generator'),
        fields: [
          freeRadius('wave_generator', 'bore_radius', 'R_i', 'no_bore'),
        ],
      },
      {
        title: t('part.ring'),
        fields: [
          freeRadius('ring', 'outer_radius', 'R_o', 'outer_radius'),
          unlessSaid('/parts/ring/rim', [{ value: 'housed' }, { value: 'free' }]),
        ],
      },
      {
        title: t('part.carrier'),
        hint: t('hint.carrier'),
        fields: [
          freeRadius('carrier', 'inner_radius', 'R_i', 'tenth_free'),
          freeRadius('carrier', 'outer_radius', 'R_o', 'tenth_free'),
          unlessSaid('/parts/carrier/fingers', [{ value: 'held_at_both_ends' }, { value: 'far_ends_joined' }, { value: 'held_at_one_end' }, { value: 'web_in_the_middle' }]),
          number('/parts/carrier/finger_fillet_radius_mm', 'r_f', 'mm', { optional: () => t('empty.fillet'), step: 0.1 }),
          unlessSaid('/parts/carrier/strength', STRENGTHS),
        ],
      },
    ],
  },
  {
    ...group('/sweep'),
    summary: (design) => {
      const tolerance = at(design, '/sweep/tolerance');
      return tolerance === undefined ? t('summary.samples', { count: at(design, '/sweep/samples') ?? 50 }) : t('summary.tolerance', { tolerance });
    },
    fields: [
      oneOf('/sweep', [
        { key: 'samples', preset: 50, field: whole('/sweep/samples', 'N', { preset: 50 }) },
        { key: 'tolerance', preset: 1e-6, field: number('/sweep/tolerance', 'τ', '') },
      ]),
      flag('/sweep/wind_up'),
      number('/profile/chord_tolerance_mm', 't', 'mm', { preset: 0.001, step: 0.001 }),
      choice('/profile/extent', [{ value: 'tooth' }, { value: 'full' }]),
    ],
  },
];
