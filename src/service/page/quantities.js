// What can be asked of a design, as the service lists it, in words for people.

import { at } from './design.js';
import { number, withUnit } from './format.js';
import { getJson } from './service.js';
import { capital, t, textOf } from './texts.js';

const GROUPS = [
  { title: t('quantities.geometry'), needs: ['drive'] },
  { title: t('quantities.load'), needs: ['load', 'allowable_stress', 'carrier_strength'] },
  { title: t('quantities.friction'), needs: ['friction', 'friction_and_speed'] },
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

/** The name of a quantity in words; one that the page does not know is spelled as it is. */
const labelOf = ({ name }) => textOf(`quantity.${name}`) ?? capital(name.replaceAll('_', ' '));

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
    return this.get(name).is_flag ? (value ? t('result.yes') : t('result.no')) : number(value, significant, scientific);
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
    return unit ? t('plot.headed', { title: label, unit }) : label;
  }
}
