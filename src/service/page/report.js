// What only paper shows: the design as a table, with its name, date and address, and the findings as another. The rest of the
// report is the page itself.

import { GROUPS, at, fieldsOf } from './design.js';
import { html } from './dom.js';
import { basisOf, contactOf, kindOf, meaningOf, readable, sentence } from './findings.js';
import { number, withUnit } from './format.js';

function shownValue(field, design) {
  const value = at(design, field.pointer);
  if (field.kind === 'variant') return field.options.find((option) => option.value === (value?.[field.tag] ?? field.options[0].value))?.label;
  if (field.kind === 'choice') return field.options.find((option) => option.value === (value ?? field.options[0].value))?.label;
  if (field.kind === 'oneOf') return undefined;
  const shown = value ?? field.preset;
  return typeof shown === 'number' ? withUnit(String(shown), field.unit) : undefined;
}

export function reportOf(name, { design, shown, reference }, address) {
  const groups = GROUPS.filter((group) => !group.parts).map((group) => {
    // Of several options only the given one has a value of its own; the others have presets for when they are chosen.
    const options = new Set((group.fields ?? []).flatMap((field) => field.options ?? []).flatMap((option) => option.fields ?? option.field ?? []));
    const rows = [...fieldsOf(group)]
      .filter((field) => !options.has(field) || at(design, field.pointer) !== undefined)
      .map((field) => [field.label, shownValue(field, design)])
      .filter(([, value]) => value !== undefined)
      .map(([label, value]) => html('tr', {}, html('th', {}, label), html('td', {}, value)));
    return rows.length ? html('table', {}, html('caption', {}, group.title), html('tbody', {}, rows)) : undefined;
  });
  const materials = GROUPS.find((group) => group.pointer === '/materials');
  const parts = materials.parts.map(({ title, fields }) =>
    html('tr', {}, html('th', {}, title), html('td', {}, fields.map((field) => shownValue(field, design)).join(', ν '))),
  );
  // Few designs give them, but then up to eight: lines across the page take less of it than a table.
  const made = GROUPS.find((group) => group.pointer === '/parts');
  const given = made.parts
    .map(({ title, fields }) => [title, fields.filter((field) => shownValue(field, design)).map((field) => `${field.label.toLowerCase()} ${shownValue(field, design)}`)])
    .filter(([, values]) => values.length > 0)
    .map(([title, values]) => `${title}: ${values.join(', ')}`);
  return [
    html('h1', {}, name),
    html(
      'p',
      { class: 'imprint' },
      `Calculated ${new Date().toISOString().slice(0, 10)} by toothwave ${shown?.answers.geometry.solver_version ?? ''}`,
      reference ? `; compared with the reference ${reference.name}` : '',
      ' · ',
      html('a', { href: address }, 'this design on line'),
    ),
    html('div', { class: 'report-design' }, groups.filter(Boolean), html('table', {}, html('caption', {}, materials.title), html('tbody', {}, parts))),
    given.length > 0 ? html('p', { class: 'report-parts' }, html('b', {}, `${made.title}. `), `${given.join('. ')}.`) : '',
  ];
}

/** Findings of one kind share a title and an advice, and each has its line; what they mean stands below where few have to share
 *  the page. */
export function findingsTable(findings) {
  const kinds = new Map();
  for (const finding of findings) kinds.set(finding.code, [...(kinds.get(finding.code) ?? []), finding]);
  const head = ['Finding', 'Here', 'Limit', 'What to change'].map((text) => html('th', { scope: 'col' }, text));
  const bodies = [...kinds.values()].map((kind) => {
    const [first] = kind;
    const rows = kind.map((finding) => {
      const { value, limit, unit } = finding;
      const where = contactOf(finding)?.name.toLowerCase();
      return html(
        'tr',
        {},
        finding === first && html('th', { scope: 'rowgroup', rowspan: kind.length }, kindOf(first)),
        html('td', {}, where && `${where} `, html('b', { class: 'number' }, withUnit(number(value, 5), unit))),
        html('td', {}, html('span', { class: 'number' }, withUnit(number(limit, 5), unit)), finding === first && html('span', { class: 'basis' }, basisOf(first))),
        finding === first && html('td', { rowspan: kind.length }, sentence(readable(first.advice))),
      );
    });
    const meaning = html('tr', { class: 'meaning' }, html('td', { colspan: 4 }, [...new Set(kind.map(meaningOf))].join(' ')));
    return html('tbody', { class: first.severity }, rows, meaning);
  });
  return findings.length > 0 ? [html('thead', {}, html('tr', {}, head)), ...bodies] : [];
}
