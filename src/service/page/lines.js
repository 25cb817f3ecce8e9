// A list of objects with the same few numbers, as text: an object a line, its numbers in the order of the field's columns.

import { typed } from './format.js';
import { listed, t } from './texts.js';

const keyIn = (item, { key, others = [] }) => [key, ...others].find((name) => item?.[name] !== undefined) ?? key;

/** The lines of a document's list. */
export function linesOf({ columns }, items) {
  if (!Array.isArray(items)) return [];
  return items.map((item) =>
    columns
      .map((column) => {
        const value = item?.[keyIn(item, column)];
        return typeof value === 'number' ? String(Number((value * (column.factor ?? 1)).toPrecision(12))) : '?';
      })
      .join('  '),
  );
}

/** The list that lines mean, `{ value }`, or `{ fault }` in words; what a line is about under another name keeps it, line by line. */
export function linesRead({ columns }, text, before) {
  const lines = text.split('\n').filter((line) => line.trim() !== '');
  const value = [];
  for (const [index, line] of lines.entries()) {
    const numbers = line
      .trim()
      .split(/[\s;]+/)
      .filter((part) => !columns.some(({ unit }) => unit === part))
      .map((part, place) => typed(part, columns[place]?.unit).value);
    if (numbers.length !== columns.length || numbers.includes(undefined)) {
      return { fault: t('fault.lines', { line: index + 1, count: columns.length, units: listed(columns.map(({ unit }) => unit)) }) };
    }
    const old = before?.[index];
    value.push(Object.fromEntries(columns.map((column, at) => [keyIn(old, column), Number((numbers[at] / (column.factor ?? 1)).toPrecision(12))])));
  }
  return { value };
}
