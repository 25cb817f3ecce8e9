// Why a search found what it found: which limits variants fell to, which bind, and what would have to give where nothing is possible.

import { number } from './format.js';

/** Within this share of a limit a drive is close to it. */
const CLOSE = 0.01;

const keyOf = ({ quantity, bound }) => `${bound} ${quantity}`;

const scaleOf = (limit) => Math.abs(limit) || 1;

/** How far a value is beyond a limit, as a share of it. */
function beyond({ bound, limit }, value) {
  const by = { min: limit - value, max: value - limit, is: Math.abs(value - limit) }[bound];
  return Math.max(0, by) / scaleOf(limit);
}

const isClose = ({ bound, limit }, value) => bound !== 'is' && Math.abs(value - limit) <= CLOSE * scaleOf(limit);

/** One drive is better than another in something and worse in nothing. */
function beats(one, other, goals) {
  const gains = goals.map(({ quantity, goal }) => (goal === 'min' ? 1 : -1) * (other.quantities[quantity] - one.quantities[quantity]));
  return gains.every((gain) => gain >= 0) && gains.some((gain) => gain > 0);
}

/** What several searches for the same goals come to together: the drives that none beats, in the order of the first goal, each with the limits
 *  that it is close to; each limit with what fell to it in all of them; and of each search that has nothing, the least change that would do. `answers` are `{ label, answer }`. */
export function together(answers, goals) {
  const all = answers.flatMap(({ label, answer }, search) => answer.front.map((found) => ({ ...found, label, search })));
  const sense = goals[0]?.goal === 'max' ? -1 : 1;
  const front = all
    .filter((found) => !all.some((other) => beats(other, found, goals)))
    .sort((one, other) => sense * (one.quantities[goals[0].quantity] - other.quantities[goals[0].quantity]))
    .map((found, index) => ({ ...found, name: `Drive ${index + 1}` }));
  const limits = new Map();
  const scan = { variants: 0, good: 0, impossible: 0, reasons: new Map() };
  for (const { answer } of answers) {
    for (const limit of answer.limits) {
      const sum = limits.get(keyOf(limit)) ?? { ...limit, fell: 0, fell_alone: 0, binds: 0 };
      sum.fell += limit.fell;
      sum.fell_alone += limit.fell_alone;
      limits.set(keyOf(limit), sum);
    }
    for (const count of ['variants', 'good', 'impossible']) scan[count] += answer.scan[count];
    for (const { code, pointer, variants, detail } of answer.scan.reasons) {
      const key = `${code} ${pointer}`;
      const sum = scan.reasons.get(key) ?? { detail, variants: 0 };
      sum.variants += variants;
      scan.reasons.set(key, sum);
    }
  }
  for (const found of front) found.heldBy = [...limits.values()].filter((limit) => isClose(limit, found.quantities[limit.quantity]));
  for (const limit of limits.values()) limit.binds = front.filter(({ heldBy }) => heldBy.includes(limit)).length;
  const without = answers.filter(({ answer }) => answer.front.length === 0);
  return {
    front,
    limits: [...limits.values()].filter(({ fell, binds }) => fell > 0 || binds > 0).sort((one, other) => other.fell - one.fell),
    scan: { ...scan, reasons: [...scan.reasons.values()].sort((one, other) => other.variants - one.variants) },
    without: without.map(({ label, answer }) => ({ label, ...missOf(answer) })),
  };
}

/** Of a search that found nothing: the nearest miss with the limits that it misses, and each limit that could give alone, the one that has
 *  to give least first. */
function missOf({ nearest_miss: miss, relaxations, limits }) {
  const missed = miss && limits.filter((limit) => beyond(limit, miss.quantities[limit.quantity]) > 0);
  const change = ({ limit, needed }) => Math.abs(needed - limit) / scaleOf(limit);
  return { miss: miss && { ...miss, missed }, relaxations: [...relaxations].sort((one, other) => change(one) - change(other)) };
}

/** A limit in words; within a sentence they begin small. */
export function limitInWords({ quantity, bound, limit }, quantities, { isWithin = false } = {}) {
  const { label: name } = quantities.get(quantity);
  const label = isWithin ? small(name) : name;
  if (bound === 'is') return `${label}: ${limit ? 'yes' : 'no'}`;
  return `${label} at ${bound === 'max' ? 'most' : 'least'} ${quantities.shown(quantity, limit)}`;
}

export const small = (text) => text[0].toLowerCase() + text.slice(1);

/** A number that a limit can be set to so that what needs it fits: rounded to the far side. */
export function roomFor({ bound, needed }) {
  const step = 10 ** (Math.floor(Math.log10(Math.abs(needed) || 1)) - 3);
  const rounded = bound === 'max' ? Math.ceil(needed / step) * step : Math.floor(needed / step) * step;
  return Number(rounded.toPrecision(6));
}

/** A count, and its share of all. */
export const counted = (count, all) => `${number(count, 9)}${all > 0 ? ` (${number((100 * count) / all, 2)}\u202f%)` : ''}`;
