// What the service says in English: in the page's language by its codes, and with digits that can be read.

import { number } from './format.js';
import { SERVICE, capital, filled, t } from './texts.js';

/** The service spells numbers with all their digits and marks words of the document; in a sentence a designer wants the digits
 *  that matter, and quotes. */
const readable = (text) => text.replace(/\d+\.\d{5,}/g, (digits) => number(Number(digits), 6)).replace(/`([^`]*)`/g, '“$1”');

export const sentence = (text) => `${capital(text)}${/[.。]$/.test(text) ? '' : t('list.stop')}`;

/** Why there is no answer, of a problem, of a field or of a variant: `{ code, detail, value, limit }`. */
export function detailOf({ code, detail, value, limit }) {
  const text = SERVICE.reasons?.[code];
  if (text === undefined) return readable(detail);
  const which = `${value === undefined ? '' : 'value'}${limit === undefined ? '' : 'limit'}`;
  const numbers = which === '' ? '' : filled(SERVICE.numbers[which], { value: number(value, 6), limit: number(limit, 6) }).join('');
  return filled(text, { detail: readable(detail) }).join('') + numbers;
}

/** A problem's title; a code that has none is spelled in words. */
export const titleOfCode = (code) => SERVICE.titles?.[code] ?? code.replaceAll('_', ' ');

/** A problem in words, with its fields. */
export const problemInWords = (problem) => ({
  ...problem,
  title: SERVICE.titles?.[problem.code] ?? problem.title,
  detail: detailOf(problem),
  errors: problem.errors?.map((error) => ({ ...error, detail: detailOf(error) })),
});

/** A finding in words. */
export function findingInWords(finding) {
  const { detail = finding.detail, advice = finding.advice } = SERVICE.findings?.[finding.code] ?? {};
  return { ...finding, detail: readable(detail), advice: readable(advice) };
}
