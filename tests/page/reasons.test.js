// Calculations of the page from studies' answers, without a browser.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { drawableStudy, thinned } from '../../src/service/page/grids.js';
import { bestOf, held, roomFor, together } from '../../src/service/page/reasons.js';
import { FIRST, faultsOf, searchesOf } from '../../src/service/page/requirements.js';

const GOALS = [{ quantity: 'size', goal: 'min' }, { quantity: 'strength', goal: 'max' }];

const drive = (size, strength) => ({ design: { size, strength }, quantities: { size, strength } });
const search = (front, more) => ({ front, limits: [], scan: { variants: 10, good: 1, impossible: 2, reasons: [] }, relaxations: [], ...more });

test('several searches join to one sorted front', () => {
  // Pseudo-random, with many dominated drives across searches and a few equal ones.
  let state = 7;
  const next = () => (state = (state * 48271) % 2147483647) % 40;
  const fronts = [0, 1, 2].map(() => Array.from({ length: 60 }, () => drive(next(), next())));
  const { drives, limits } = together(fronts.map((found, index) => ({ label: `kind ${index}`, answer: search(found) })));
  const { front } = held(bestOf(drives, GOALS), limits);
  const all = fronts.flat();
  const isBeaten = ({ quantities: { size, strength } }) =>
    all.some(({ quantities: other }) => other.size <= size && other.strength >= strength && (other.size < size || other.strength > strength));
  const expected = all.filter((found) => !isBeaten(found)).map(({ design }) => design);
  assert.equal(front.length, expected.length);
  for (const { design } of front) assert.ok(expected.includes(design));
  for (let index = 1; index < front.length; index += 1) assert.ok(front[index - 1].quantities.size <= front[index].quantities.size);
  assert.deepEqual(front.slice(0, 2).map(({ name }) => name), ['Drive 1', 'Drive 2']);
});

test('failed counts add up, binding counts follow the front', () => {
  const limits = (fell) => [{ quantity: 'size', bound: 'max', limit: 100, fell, fell_alone: 1, binds: 0 }];
  const answers = [search([drive(99.5, 5), drive(50, 3)], { limits: limits(4) }), search([drive(40, 1)], { limits: limits(3) })];
  const found = together(answers.map((answer, index) => ({ label: String(index), answer })));
  const { front, limits: [limit] } = held(bestOf(found.drives, GOALS), found.limits);
  const { scan } = found;
  assert.deepEqual([limit.fell, limit.fell_alone, limit.binds], [7, 2, 1]);
  assert.deepEqual(front.map(({ heldBy }) => heldBy.length), [0, 0, 1], 'each drive tells what holds it back');
  assert.deepEqual([scan.variants, scan.impossible], [20, 4]);
});

test('smallest relaxation comes first', () => {
  const limits = [{ quantity: 'size', bound: 'max', limit: 100, fell: 9, fell_alone: 0, binds: 0 }, { quantity: 'strength', bound: 'min', limit: 10, fell: 9, fell_alone: 0, binds: 0 }];
  const relaxations = [{ quantity: 'strength', bound: 'min', limit: 10, needed: 8 }, { quantity: 'size', bound: 'max', limit: 100, needed: 101.2 }];
  const { without: [miss] } = together([{ label: 'one', answer: search([], { limits, relaxations, nearest_miss: drive(101, 10) }) }]);
  assert.deepEqual(miss.relaxations.map(({ quantity }) => quantity), ['size', 'strength']);
  assert.deepEqual(miss.miss.missed.map(({ quantity }) => quantity), ['size']);
});

test('relaxed limit is rounded towards the looser side', () => {
  assert.equal(roomFor({ bound: 'max', needed: 65.37249 }), 65.38);
  assert.equal(roomFor({ bound: 'min', needed: 75.41247 }), 75.41);
  for (const needed of [1e-3, 0.123456, 9.9999, 152.0001, 123456.7]) {
    assert.ok(roomFor({ bound: 'max', needed }) >= needed);
    assert.ok(roomFor({ bound: 'min', needed }) <= needed);
  }
});

test('thinned curve keeps its extremes and gaps', () => {
  const values = Float64Array.from({ length: 10001 }, (_, index) => Math.sin(index / 500));
  values[4321] = 9;
  values[1234] = -9;
  values[7777] = NaN;
  const kept = thinned(values, 2400);
  assert.ok(kept.length <= 2400 + 1);
  for (const index of [4321, 1234, 7777]) assert.ok(kept.includes(index), String(index));
  for (let index = 1; index < kept.length; index += 1) assert.ok(kept[index] > kept[index - 1]);
  assert.deepEqual(thinned([1, 2, 3], 2400), [0, 1, 2]);
});

test('rows of a map go to their grid cells', () => {
  const answer = { study: 'map', variants: 4, over: [], is_complete: false, possible: { variant: [0, 3], quantities: { size: [5, 6] } }, impossible: { variant: [1], reason: [0] }, reasons: [{}] };
  const { quantities, reason } = drawableStudy(answer);
  assert.deepEqual([...quantities.size], [5, NaN, NaN, 6]);
  assert.deepEqual([...reason], [0, 1, 0, 0]);
});

test('each kind has own search with fitting slots', () => {
  const requirements = { find: { ...FIRST.find, wave_generators: { eccentric: true, harmonic_more: true }, lobes: 3, ratio: 19.5, ratio_max: 20.5 } };
  const [one, three] = searchesOf(requirements);
  assert.equal(one.question.base.drive.teeth.count, 20, 'one lobe has a whole ratio');
  assert.deepEqual(three.question.free['/drive/teeth/count'], { min: 59, max: 61 });
  const [none] = searchesOf({ find: { ...FIRST.find, wave_generators: { eccentric: true }, ratio: 19.2, ratio_max: 19.8 } });
  assert.match(none.fault, /with one lobe a ratio is a whole number/);
  assert.deepEqual(faultsOf(FIRST), { faults: [], isEmpty: false });
});
