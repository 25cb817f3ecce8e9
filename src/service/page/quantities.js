// What can be asked of a design, as the service lists it, in words for people.

import { at } from './design.js';
import { number, withUnit } from './format.js';
import { getJson } from './service.js';

/** How names end in units; the longest first. */
const UNIT_ENDINGS = /_(nm_per_rad|mpa_m_per_s|arcmin|mm|deg|mpa|nm|um|n|w)$/;

const PHRASES = [
  [/^carrier_finger_share$/, 'finger deflection over contact deflection'],
  [/^coincidence_degree$/, 'contact ratio'],
  [/^carrier_radial_space$/, 'height of the carrier'],
  [/_over_/, ' over '],
  [/_(min|least)$/, ', least'],
  [/_(max|largest)$/, ', largest'],
  [/_mean$/, ', mean'],
  [/_peak_to_peak$/, ', peak to peak'],
  [/^(.+)_back_driven$/, '$1, back-driven'],
  [/^efficiency_(.+)_fixed/, 'efficiency, $1 fixed'],
  [/^(transmission_ratio)$/, '$1, ring fixed'],
  [/^(transmission_ratio)_carrier_fixed$/, '$1, carrier fixed'],
  [/^(peak_force|peak_stress|half_width|loss_ratio|pressure_velocity)_(wave_generator|ring|carrier|bearing)$/, '$1, $2'],
  [/^(torque_capacity)_(input|output)$/, '$1, $2'],
  [/^(tooth_center_clearance)_(inner|outer)$/, '$1, $2'],
];

const GROUPS = [
  { title: 'Geometry', needs: ['drive'] },
  { title: 'Under load', needs: ['load', 'allowable_stress', 'carrier_strength'] },
  { title: 'Friction', needs: ['friction', 'friction_and_speed'] },
];

/** Of a design, whether it has what a quantity needs. */
const HAS = {
  drive: () => true,
  load: (design) => at(design, '/load') !== undefined,
  allowable_stress: (design) => at(design, '/load/allowable_stress_mpa') !== undefined,
  carrier_strength: (design) => at(design, '/load') !== undefined && at(design, '/parts/carrier/strength') !== undefined,
  friction: (design) => at(design, '/load') !== undefined && at(design, '/friction') !== undefined,
  friction_and_speed: (design) => at(design, '/friction') !== undefined && (at(design, '/load/input_speed_rpm') ?? at(design, '/load/duty')) !== undefined,
};

function labelOf({ name }) {
  const bare = name.replace(UNIT_ENDINGS, '');
  const phrase = PHRASES.reduce((text, [pattern, words]) => text.replace(pattern, words), bare).replaceAll('_', ' ').replaceAll('center', 'centre');
  return phrase[0].toUpperCase() + phrase.slice(1);
}

/** The quantities in the service's order, each with its `label`. */
export class Quantities {
  #all = new Map();

  async load() {
    const { quantities } = await getJson('v1/quantities');
    this.#all = new Map(quantities.map((quantity) => [quantity.name, { ...quantity, label: labelOf(quantity) }]));
  }

  get(name) {
    return this.#all.get(name) ?? { name, label: labelOf({ name }), unit: '', needs: 'drive' };
  }

  has(name) {
    return this.#all.has(name);
  }

  /** Those that a design has what they need for, by group. */
  groupsFor(design) {
    const all = [...this.#all.values()];
    return GROUPS.map(({ title, needs }) => ({ title, quantities: all.filter((quantity) => needs.includes(quantity.needs) && HAS[quantity.needs]?.(design)) })).filter(
      ({ quantities }) => quantities.length > 0,
    );
  }

  /** A value; `scientific` digits where it is written with a power of ten. */
  bare(name, value, significant = 4, scientific = undefined) {
    return this.get(name).is_flag ? (value ? 'yes' : 'no') : number(value, significant, scientific);
  }

  /** The same with its unit. */
  shown(name, ...value) {
    const { unit, is_flag: isFlag } = this.get(name);
    const bare = this.bare(name, ...value);
    return isFlag ? bare : withUnit(bare, unit);
  }

  /** The label with the unit, as an axis or a column has it. */
  headed(name) {
    const { label, unit } = this.get(name);
    return unit ? `${label}, ${unit}` : label;
  }
}
