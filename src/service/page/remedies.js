// Findings whose remedy is a value: what one press changes.

import { at, changed, estimatesOf, withEstimate, withVirtualWork } from './design.js';
import { number, withUnit } from './format.js';
import { t } from './texts.js';

/** Rounded to hundredths on the safe side of a limit, and off the limit itself. */
const below = (limit) => Number((Math.ceil(100 * limit - 1e-9) / 100 - 0.01).toFixed(2));
const above = (limit, step) => step * Math.ceil(limit / step);

const set = (pointer, value, unit) => ({ label: t('form.set_to', { value: withUnit(number(value, 6), unit) }), change: (design) => changed(design, pointer, value) });
const unbored = { label: t('remedy.unbored'), change: (design) => changed(design, '/drive/ring/tip_radius_mm', undefined) };
const virtualWork = { label: t('remedy.virtual_work'), change: withVirtualWork };
const johnson = { label: t('remedy.johnson'), change: (design) => changed(withVirtualWork(design), '/model/stiffness', { law: 'johnson' }) };

const compliance = (contact) => (_, answers) => estimatesOf(answers)[contact] && { label: t('remedy.compliance'), change: (design) => withEstimate(design, contact, answers) };

/** The torque capacity, at the shaft where the design gives its torque. */
function capacity(_, { sweep }, design) {
  const key = ['input_torque_nm', 'output_torque_nm'].find((name) => at(design, `/load/${name}`) !== undefined);
  const torque = key && sweep?.torque_capacity?.[key];
  if (torque === undefined) return undefined;
  const step = 10 ** (Math.floor(Math.log10(torque)) - 2);
  return set(`/load/${key}`, Number((step * Math.floor(torque / step)).toPrecision(3)), 'N·m');
}

/** By code: the remedy of a finding, or nothing where this design has none. */
const REMEDIES = {
  undercut: ({ limit }) => set('/drive/teeth/radius_mm', below(limit), 'mm'),
  bore_shortens_flank: () => unbored,
  bore_without_effect: () => unbored,
  few_teeth_in_mesh: (_, __, design) => at(design, '/drive/teeth/installed') < at(design, '/drive/teeth/count') && { label: t('remedy.every_slot'), change: (now) => changed(now, '/drive/teeth/installed', undefined) },
  hollow_wave_generator: ({ limit }) => set('/drive/wave_generator/amplitude_mm', below(limit), 'mm'),
  flat_cuts_the_contact: ({ limit }) => set('/drive/teeth/flat_length_mm', below(limit), 'mm'),
  linear_law_too_stiff: () => johnson,
  palmgren_beyond_steel: () => johnson,
  projection_on_steep_flank: () => virtualWork,
  projection_with_gap: () => virtualWork,
  slender_fingers: compliance('carrier'),
  soft_rim: compliance('ring'),
  bearing_load_above_half_rating: ({ value }) => set('/friction/wave_generator/bearing_load_rating_n', above(2 * value, 10), 'N'),
  stress_above_allowable: capacity,
  finger_overstressed: capacity,
};

/** The remedy of a finding as `{ label, change(design) }`, where it is a value. */
export const remedyOf = (finding, answers, design) => REMEDIES[finding.code]?.(finding, answers, design) || undefined;
