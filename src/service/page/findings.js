// Findings and reasons in words.

import { html } from './dom.js';
import { number, withUnit } from './format.js';
import { CONTACTS } from './motion.js';
import { capital, t, textOf } from './texts.js';
import { findingInWords, sentence } from './words.js';

/** By the code of a finding: its `title`, what it `tests`, the `source` of its limit, in a sentence its `basis`, and what `detail` and `advice`
 *  leave to be said: `why` it matters and what to `change`. */
const textsOf = ({ code }) => textOf(`finding.${code}`) ?? {};

export const kindOf = (finding) => textsOf(finding).title ?? capital(finding.code.replaceAll('_', ' '));

/** The contact that a finding is about, where it is about one. */
export const contactOf = ({ pointers }) => CONTACTS.find(({ key }) => pointers.includes(`/materials/${key}`));

export function titleOf(finding) {
  const contact = contactOf(finding);
  return contact ? t('result.of', { what: kindOf(finding), part: contact.name.toLowerCase() }) : kindOf(finding);
}

export const sourceOf = (finding) => textsOf(finding).source;

/** What a finding means beyond its title, its numbers and its contact. */
export function meaningOf(finding) {
  const { why = '' } = textsOf(finding);
  return contactOf(finding) && why ? why : `${sentence(finding.detail)} ${why}`.trim();
}

/** What a finding tests, why it matters and what to change. `goTo(pointer)` leads to a field. */
export function explanation(finding, labelOf, goTo) {
  const { value, limit, unit, detail, advice, pointers } = finding;
  const here = t('explanation.here', { value: withUnit(number(value, 5), unit), limit: withUnit(number(limit, 5), unit) });
  const { tests = '', basis = '', why = '', change = '' } = textsOf(finding);
  const fields = pointers.map((pointer) =>
    html('button', { type: 'button', class: 'link', onclick: () => goTo(pointer) }, labelOf(pointer)),
  );
  return html(
    'dl',
    { class: 'explanation' },
    html('dt', {}, t('explanation.tested')),
    html('dd', {}, `${tests} ${here} ${basis}`.trim()),
    html('dt', {}, t('explanation.why')),
    html('dd', {}, `${sentence(detail)} ${why}`),
    html('dt', {}, t('explanation.change')),
    html('dd', {}, `${sentence(advice)} ${change} `, html('span', { class: 'fields' }, fields)),
  );
}

/** A wall that is not there is no matter of a rule of thumb. */
const asFault = (finding) => (finding.code === 'thin_slot_wall' && finding.value <= 0 ? { ...finding, code: 'no_slot_wall', severity: 'problem', limit: 0 } : finding);

/** All findings of a result, each once, with a key that stays while numbers change. */
export function findingsOf(answers) {
  const unique = new Map();
  for (const finding of [answers.sweep, answers.geometry, answers.coincidence].flatMap((answer) => answer?.findings ?? [])) {
    unique.set(JSON.stringify([finding.code, finding.detail]), findingInWords(asFault(finding)));
  }
  const counts = new Map();
  const faultsFirst = [...unique.values()].sort((one, other) => (other.severity === 'problem') - (one.severity === 'problem'));
  return faultsFirst.map((finding) => {
    const name = `${finding.code}-${contactOf(finding)?.key ?? ''}`;
    const count = (counts.get(name) ?? 0) + 1;
    counts.set(name, count);
    return { ...finding, key: `${name}-${count}` };
  });
}

/** All reasons of a result's problems, each once; a problem without fields is a reason of the whole design. */
export function reasonsOf(problems) {
  const unique = new Map();
  for (const problem of problems) {
    const errors = problem.errors?.length ? problem.errors : [{ pointer: '', code: problem.code, detail: problem.detail }];
    for (const error of errors) unique.set(`${error.pointer} ${error.code} ${error.detail}`, { ...error, title: problem.title });
  }
  return [...unique.values()];
}
