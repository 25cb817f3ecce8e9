// Why a search found what it found: which limits variants fell to, which bind, and what would have to give where nothing is possible.

import { number } from './format.js';
import { small, t } from './texts.js';

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

/** So many drives are shown: enough to choose from, few enough to look at. */
const MOST_SHOWN = 40;

/** Of drives in order so many that lie evenly, with both ends. */
const spreadOut = (drives, most) => (drives.length <= most ? drives : Array.from({ length: most }, (_, index) => drives[Math.round((index * (drives.length - 1)) / (most - 1))]));

/** The drives that none beats, in the order of the first goal, at most as many as are shown. */
export function bestOf(drives, goals) {
  const [{ quantity, goal }] = goals;
  const sense = goal === 'max' ? -1 : 1;
  const front = drives.filter((found) => !drives.some((other) => beats(other, found, goals)));
  return spreadOut(front.sort((one, other) => sense * (one.quantities[quantity] - other.quantities[quantity])), MOST_SHOWN);
}

/** Names the drives, says of each which limits it is close to, and of each limit how many drives are close to it. */
export function held(drives, limits) {
  const front = drives.map((found, index) => ({ ...found, name: t('limits.drive', { number: index + 1 }), heldBy: limits.filter((limit) => isClose(limit, found.quantities[limit.quantity])) }));
  return { front, limits: limits.map((limit) => ({ ...limit, binds: front.filter(({ heldBy }) => heldBy.includes(limit)).length })).filter(({ fell, binds }) => fell > 0 || binds > 0) };
}

/** What several searches for the same goals come to together: all drives; each limit with what fell to it in all of them; and of each search
 *  that has nothing, the least change that would do. `answers` are `{ label, question, answer }`. */
export function together(answers) {
  const drives = answers.flatMap(({ label, question, answer }, search) => answer.front.map((found) => ({ ...found, label, question, search })));
  const limits = new Map();
  const scan = { variants: 0, impossible: 0, reasons: new Map() };
  for (const { answer } of answers) {
    for (const limit of answer.limits) {
      const sum = limits.get(keyOf(limit)) ?? { ...limit, fell: 0, fell_alone: 0 };
      sum.fell += limit.fell;
      sum.fell_alone += limit.fell_alone;
      limits.set(keyOf(limit), sum);
    }
    for (const count of ['variants', 'impossible']) scan[count] += answer.scan[count];
    for (const { code, pointer, variants, detail } of answer.scan.reasons) {
      const key = `${code} ${pointer}`;
      const sum = scan.reasons.get(key) ?? { detail, variants: 0 };
      sum.variants += variants;
      scan.reasons.set(key, sum);
    }
  }
  const without = answers.filter(({ answer }) => answer.front.length === 0);
  return {
    drives,
    limits: [...limits.values()].sort((one, other) => other.fell - one.fell),
    scan: { ...scan, reasons: [...scan.reasons.values()].sort((one, other) => other.variants - one.variants) },
    without: without.map(({ label, answer }) => ({ label, ...missOf(answer) })).sort((one, other) => leastChange(one) - leastChange(other)),
  };
}

const changeOf = ({ limit, needed }) => Math.abs(needed - limit) / scaleOf(limit);

/** How far the limit that can give most easily has to. */
const leastChange = ({ relaxations }) => (relaxations.length > 0 ? changeOf(relaxations[0]) : Infinity);

/** Of a search that found nothing: the nearest miss with the limits that it misses, and each limit that could give alone, the one that has
 *  to give least first. */
function missOf({ nearest_miss: miss, relaxations, limits }) {
  const missed = miss && limits.filter((limit) => beyond(limit, miss.quantities[limit.quantity]) > 0);
  return { miss: miss && { ...miss, missed }, relaxations: [...relaxations].sort((one, other) => changeOf(one) - changeOf(other)) };
}

/** A value in words that differ from those of its limit. */
export function apart(quantities, name, value, limit) {
  const digits = [4, 5, 6, 7, 8, 9].find((count) => quantities.shown(name, value, count) !== quantities.shown(name, limit, count));
  return quantities.shown(name, value, digits ?? 9);
}

/** A limit in words; within a sentence they begin small. */
export function limitInWords({ quantity, bound, limit }, quantities, { isWithin = false } = {}) {
  const { label: name } = quantities.get(quantity);
  const label = isWithin ? small(name) : name;
  if (bound === 'is') return limit ? t('limits.is', { label }) : t('limits.is_not', { label });
  const value = quantities.shown(quantity, limit);
  return bound === 'max' ? t('limits.at_most', { label, value }) : t('limits.at_least', { label, value });
}

/** A number that a limit can be set to so that what needs it fits: rounded to the far side. */
export function roomFor({ bound, needed }) {
  const step = 10 ** (Math.floor(Math.log10(Math.abs(needed) || 1)) - 3);
  const rounded = bound === 'max' ? Math.ceil(needed / step) * step : Math.floor(needed / step) * step;
  return Number(rounded.toPrecision(6));
}

/** A count, and its share of all. */
export const shareOf = (count, all) => `${number(count, 9)}${all > 0 ? ` (${number((100 * count) / all, 2)}\u202f%)` : ''}`;
