// Documents of earlier versions, without their deprecated fields.

import { at, changed } from './design.js';

const SWITCHES = ['ring_teeth_bend', 'wave_generator_moves', 'corner_contact'];

/** Gaps of `model.clearance` as clearances of the parts; those that the parts contradict stay, for the service to refuse. */
function withClearances(design) {
  const gaps = at(design, '/model/clearance') ?? {};
  const teeth = at(design, '/parts/teeth/clearance_um') ?? 0;
  let next = design;
  for (const part of ['wave_generator', 'ring', 'carrier']) {
    const [place, gap] = [`/parts/${part}/clearance_um`, gaps[`${part}_um`] ?? 0];
    const made = (at(design, place) ?? 0) + teeth;
    if (gap !== 0 && made === 0) next = changed(next, place, gap);
    if (made === 0 || gap === 0 || gap === made) next = changed(next, `/model/clearance/${part}_um`, undefined);
  }
  const isEmpty = Object.keys(at(next, '/model/clearance') ?? {}).length === 0;
  return isEmpty && at(next, '/model/clearance') !== undefined ? changed(next, '/model/clearance', undefined) : next;
}

/** Deprecated switches as `model.refinements`. What is left of `auto` without a wave generator that moves depends on the geometry: then they stay. */
function withRefinements(design) {
  const [bend, moves, corner] = SWITCHES.map((key) => at(design, `/model/${key}`));
  if ([bend, moves, corner].every((given) => given === undefined) || (moves === false && bend === undefined)) return design;
  const list = bend === false || moves === false ? [] : ['auto'];
  SWITCHES.forEach((key, index) => [bend, moves, corner][index] && list.push(key));
  const next = SWITCHES.reduce((left, key) => changed(left, `/model/${key}`, undefined), design);
  const isAuto = list.length === 1 && list[0] === 'auto';
  return isAuto ? next : changed(next, '/model/refinements', list.length === 0 ? 'none' : list);
}

/** The document without the deprecated fields that have a replacement: itself where it has none. */
export function converted(design) {
  const has = (key) => at(design, `/model/${key}`) !== undefined;
  return ['clearance', ...SWITCHES].some(has) ? withRefinements(withClearances(design)) : design;
}
