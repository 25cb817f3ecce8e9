// Numbers as a designer reads them: enough significant digits to tell designs apart, no more.

import { t } from './texts.js';

const MINUS = '\u2212';
const THIN_SPACE = '\u202f';
const SUPERSCRIPTS = '⁰¹²³⁴⁵⁶⁷⁸⁹';

export const DASH = '–';

export function number(value, significant = 5, scientific = Math.min(significant, 3)) {
  if (!Number.isFinite(value)) return DASH;
  if (value === 0) return '0';
  const sign = value < 0 ? MINUS : '';
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e7) {
    const [digits, exponent] = size.toExponential(scientific - 1).split('e');
    const raised = [...String(Math.abs(Number(exponent)))].map((digit) => SUPERSCRIPTS[digit]).join('');
    return `${sign}${Number(digits)}·10${Number(exponent) < 0 ? '⁻' : ''}${raised}`;
  }
  const places = Math.max(0, significant - 1 - Math.floor(Math.log10(size)));
  const [whole, fraction] = size.toFixed(Math.min(places, 12)).split('.');
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN_SPACE) : whole;
  const shown = fraction?.replace(/0+$/, '');
  return sign + grouped + (shown ? `.${shown}` : '');
}

/** A fixed number of places, for readings that move and must not jump about. */
export function fixed(value, places) {
  if (!Number.isFinite(value)) return DASH;
  const text = Math.abs(value).toFixed(places);
  return (value < 0 && Number(text) !== 0 ? MINUS : '') + text;
}

/** A difference with its sign, and its share of the reference. */
export function difference(value, reference, significant = 3) {
  if (!Number.isFinite(value) || !Number.isFinite(reference)) return '';
  const delta = value - reference;
  const size = Math.max(Math.abs(value), Math.abs(reference));
  if (size === 0 || Math.abs(delta) <= 1e-9 * size) return '=';
  const sign = delta > 0 ? '+' : '';
  const share = reference === 0 ? '' : ` (${sign}${fixed((100 * delta) / Math.abs(reference), 1)}${THIN_SPACE}%)`;
  return `${sign}${number(delta, significant)}${share}`;
}

export const withUnit = (text, unit) => (unit && text !== DASH ? `${text}${THIN_SPACE}${unit}` : text);

const PLAIN = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
const WITH_COMMA = /^([+-]?\d*),(\d*(?:e[+-]?\d+)?)$/i;
const THOUSANDS = /^[+-]?[1-9]\d{0,2},\d{3}$/;

/** Other ways to write a unit. */
const SPELLINGS = { µm: ['um', 'μm'], 'N·m': ['Nm', 'N*m', 'N m'], '1/min': ['rpm', 'min-1', 'U/min'], deg: ['°'], '″': ['"', 'arcsec'] };

/** The text without the unit of its field; another unit stays, and is a fault. */
function withoutUnit(text, unit) {
  const spellings = unit ? [unit, ...(SPELLINGS[unit] ?? [])] : [];
  const found = spellings.find((spelling) => text.toLowerCase().endsWith(spelling.normalize('NFKC').toLowerCase()));
  return found === undefined ? text : text.slice(0, -found.normalize('NFKC').length).trimEnd();
}

/** What a person typed as a number: `{ value }`, undefined where nothing stands there, or `{ fault }` in words. A comma is a decimal
 *  sign, as a point is; where it could part thousands as well, it is asked back. Full-width characters, spaces between digits and the
 *  field's own unit are understood. */
export function typed(text, unit) {
  const plainText = text.normalize('NFKC').replaceAll('。', '.').trim();
  const compact = withoutUnit(plainText, unit).replace(/(?<=\d)[\s\u00a0\u2009\u202f](?=\d)/g, '').replace(MINUS, '-');
  if (compact === '') return { value: undefined };
  if (THOUSANDS.test(compact)) return { fault: t('fault.ambiguous', { text: compact, point: compact.replace(',', '.'), thousands: compact.replace(',', '') }) };
  const plain = compact.replace(WITH_COMMA, '$1.$2');
  if (!PLAIN.test(plain)) return { fault: unit ? t('fault.not_a_number_in', { unit }) : t('fault.not_a_number') };
  const value = Number(plain);
  return Number.isFinite(value) ? { value } : { fault: t('fault.too_large') };
}
