// Materials by name. A document has only their numbers.

import { at } from './design.js';
import { number, withUnit } from './format.js';
import { SERVICE, listed, t } from './texts.js';

const PARTS = ['wave_generator', 'teeth', 'ring', 'carrier'];

let known = [];
let strengths = [];

/** Takes the service's materials, `{ name, title, youngs_modulus_gpa, … }`, and strengths. */
export function learnMaterials({ materials, strengths: served }) {
  strengths = served;
  known = materials.map((material) => ({ ...material, title: SERVICE.materials?.[material.name] ?? material.title }));
}

export const knownMaterials = () => known;

/** The strength of a carrier's material by its name. */
export const strengthNamed = (name) => strengths.find((strength) => strength.name === name);

/** The materials that have the numbers of a part; steels share theirs. */
export function materialsOf(design, part) {
  const { youngs_modulus_gpa: modulus, poissons_ratio: ratio } = at(design, `/materials/${part}`) ?? {};
  return known.filter((material) => material.youngs_modulus_gpa === modulus && material.poissons_ratio === ratio);
}

export const titleOf = (materials) => materials.map(({ title }) => title).join(t('list.or'));

/** Of parts whose material has no published allowable stress, that the design’s own is an assumption. */
export function unpublished(design) {
  const allowable = at(design, '/load/allowable_stress_mpa');
  if (allowable === undefined) return [];
  const stressOf = (part) => (typeof allowable === 'object' ? (allowable[part] ?? Math.max(...Object.values(allowable))) : allowable);
  const assumed = PARTS.map((part) => ({ part, materials: materialsOf(design, part) }))
    .filter(({ materials }) => materials.length > 0 && materials.every(({ allowable_stress_mpa: published }) => published === undefined))
    .map(({ part, materials }) => ({ part: t(`part.${part}`).toLowerCase(), stress: withUnit(number(stressOf(part)), 'MPa'), material: titleOf(materials) }));
  const kinds = Map.groupBy(assumed, ({ stress, material }) => `${stress} ${material}`);
  return [...kinds.values()].map((alike) => t('materials.unpublished', { ...alike[0], parts: listed(alike.map(({ part }) => part)) }));
}
