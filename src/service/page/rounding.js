// Found drives with lengths as a workshop writes them. Each drive is rounded together with its neighbours, the service calculates all of
// them, and the best that keeps every limit is shown.

import { at, changed } from './design.js';

const STEP_MM = 0.01;
const tidy = (value) => Number((STEP_MM * Math.round(value / STEP_MM)).toFixed(2));

/** Wide enough for the figures of a search, which are true peaks. */
const TOLERANCE = 1e-6;

/** Diameters in mm that rollers and balls are sold with: ISO 12297 and ISO 3290-1, the usual ones. */
const STANDARD_MM = {
  cylinder: [1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 6.5, 7, 7.5, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 22, 24, 26, 28, 30, 32, 36, 40],
  ball: [1, 1.5, 1.588, 2, 2.381, 2.5, 3, 3.175, 3.5, 3.969, 4, 4.5, 4.762, 5, 5.5, 5.556, 6, 6.35, 6.5, 7, 7.144, 7.5, 7.938, 8, 8.5, 8.731, 9, 9.525, 10, 10.319, 11, 11.112, 11.906, 12, 12.7, 13, 14, 14.288, 15, 15.875, 16, 17.462, 18, 19.05, 20, 22, 22.225, 24, 25.4, 30, 40],
};

/** Radii of standard rollers or balls within a range. */
export const standardRadiiMm = (shape, [min, max]) => (STANDARD_MM[shape] ?? STANDARD_MM.cylinder).map((diameter) => Number((diameter / 2).toFixed(4))).filter((radius) => radius >= min && radius <= max);

/** The study of a found drive's rounded neighbours; nothing where it has no length to round. */
export function roundingOf({ design, quantities, question }) {
  const lengths = Object.entries(question.free).filter(([pointer, { one_of: oneOf }]) => pointer.endsWith('_mm') && !oneOf);
  if (lengths.length === 0) return undefined;
  const ends = (value) => ({ min: tidy(value - STEP_MM), max: tidy(value + STEP_MM), steps: 3 });
  const over = Object.fromEntries(lengths.map(([pointer]) => [pointer, ends(tidy(at(design, pointer)))]));
  return { study: 'map', base: { ...design, sweep: { tolerance: TOLERANCE } }, over, quantities: Object.keys(quantities) };
}

const keeps = (require, quantities) =>
  Object.entries(require).every(([name, limit]) => (typeof limit === 'boolean' ? Boolean(quantities[name]) === limit : (limit.min === undefined || quantities[name] >= limit.min) && (limit.max === undefined || quantities[name] <= limit.max)));

/** The best of the neighbours that keep every limit, as a found drive; nothing where none does. */
export function bestRounded(found, { axes, variants, reason, quantities: columns }, goals) {
  let best;
  for (let variant = 0; variant < variants; variant += 1) {
    const quantities = Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, column[variant]]));
    if (reason[variant] !== 0 || !keeps(found.question.require, quantities)) continue;
    const loss = goals.reduce((sum, { quantity, goal }) => sum + ((goal === 'min' ? 1 : -1) * (quantities[quantity] - found.quantities[quantity])) / Math.abs(found.quantities[quantity] || 1), 0);
    if (!best || loss < best.loss) best = { variant, loss, quantities };
  }
  if (!best) return undefined;
  let stride = variants;
  const design = axes.reduce((next, { pointer, values }) => {
    stride /= values.length;
    return changed(next, pointer, tidy(values[Math.floor(best.variant / stride) % values.length]));
  }, found.design);
  return { ...found, design, quantities: best.quantities };
}
