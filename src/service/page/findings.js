// Findings: what each tests stands here, why it matters and what to change come with the finding itself.

import { html } from './dom.js';
import { number, withUnit } from './format.js';

const KINDS = {
  undercut: {
    title: 'Undercut ring tips',
    tests: 'the tooth radius against the critical radius, from which the envelope of the passing tooth cuts into the ring’s own tips',
  },
  bore_shortens_flank: {
    title: 'Bore shortens the flank',
    tests: 'the bored tip radius against the ring’s natural tip radius',
  },
  bore_without_effect: {
    title: 'Bore without effect',
    tests: 'the bored tip radius against the ring’s natural tip radius',
  },
  few_teeth_in_mesh: {
    title: 'Few teeth in mesh',
    tests: 'the fewest teeth that carry load at once in a zone, at any input angle, against two',
  },
  thin_slot_wall: {
    title: 'Thin wall between slots',
    tests: 'the carrier’s wall between two slots at its inner edge against a quarter of a slot’s width',
  },
  tooth_beyond_carrier: {
    title: 'Tooth leaves the carrier',
    tests: 'the radius that a loaded tooth’s centre reaches against the edge of the carrier’s annulus',
  },
  steep_ring_flank: {
    title: 'Steep ring flank',
    tests: 'the largest pressure angle on the engaged flank of the ring',
  },
  stress_above_fatigue_limit: {
    title: 'Stress above the fatigue limit',
    tests: 'the peak contact stress over a period against the fatigue limit of bearing steel',
  },
};

const words = (code) => code.replaceAll('_', ' ').replace(/^./, (letter) => letter.toUpperCase());

export const titleOf = ({ code }) => KINDS[code]?.title ?? words(code);

/** The service spells numbers with all their digits; in a sentence a designer wants those that matter. */
export const readable = (text) => text.replace(/\d+\.\d{5,}/g, (digits) => number(Number(digits), 6));

export const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1)}${text.endsWith('.') ? '' : '.'}`;

/** What a finding tests, why it matters and what to change. `goTo(pointer)` leads to a field. */
export function explanation(finding, labelOf, goTo) {
  const { code, value, limit, unit, detail, advice, pointers } = finding;
  const measured = `${withUnit(number(value, 5), unit)} against ${withUnit(number(limit, 5), unit)}`;
  const fields = pointers.map((pointer) =>
    html('button', { type: 'button', class: 'link', onclick: () => goTo(pointer) }, labelOf(pointer)),
  );
  return html(
    'dl',
    { class: 'explanation' },
    html('dt', {}, 'What is tested'),
    html('dd', {}, KINDS[code] ? `${sentence(KINDS[code].tests)} Here: ${measured}.` : `Here: ${measured}.`),
    html('dt', {}, 'Why it matters'),
    html('dd', {}, sentence(readable(detail))),
    html('dt', {}, 'What to change'),
    html('dd', {}, `${sentence(advice)} `, html('span', { class: 'fields' }, fields)),
  );
}

/** All findings of a result, each once, with a key that stays while numbers change. */
export function findingsOf(answers) {
  const unique = new Map();
  for (const finding of [answers.sweep, answers.geometry, answers.coincidence].flatMap((answer) => answer?.findings ?? [])) {
    unique.set(JSON.stringify([finding.code, finding.detail]), finding);
  }
  const counts = new Map();
  return [...unique.values()].map((finding) => {
    const count = (counts.get(finding.code) ?? 0) + 1;
    counts.set(finding.code, count);
    return { ...finding, key: `${finding.code}-${count}` };
  });
}

/** All reasons of a result's problems, each once; a problem without fields is a reason of the whole design. */
export function reasonsOf(problems) {
  const unique = new Map();
  for (const problem of problems) {
    const errors = problem.errors?.length ? problem.errors : [{ pointer: '', code: problem.code, detail: problem.detail }];
    for (const error of errors) unique.set(`${error.pointer} ${error.code} ${error.detail}`, { ...error, detail: readable(error.detail), title: problem.title });
  }
  return [...unique.values()];
}
