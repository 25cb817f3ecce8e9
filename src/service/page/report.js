// What only paper shows: the design as a table, with its name, date and address, and the findings as another. The rest of the
// report is the page itself.

import { at } from './design.js';
import { fieldsOf, fullLabel, isOn, kindOf } from './field.js';
import { GROUPS } from './fields.js';
import { html } from './dom.js';
import { contactOf, kindOf as kindOfFinding, meaningOf, sourceOf } from './findings.js';
import { DASH, number, withUnit } from './format.js';
import { linesOf } from './lines.js';
import { materialsOf, titleOf } from './materials.js';
import { labelled, listed, t } from './texts.js';
import { sentence } from './words.js';

function shownValue(field, design) {
  const value = at(design, field.pointer);
  const labelled = (wanted) => field.options.find((option) => String(option.value) === String(wanted))?.label;
  // What has one kind alone is not told apart by it.
  if (field.kind === 'variant') return field.options.length > 1 ? labelled(kindOf(field, design)) : undefined;
  if (field.kind === 'choice') {
    const chosen = value ?? field.otherwise?.(design) ?? field.options[0].value;
    // What is left to the service is no input.
    return chosen === '' ? undefined : labelled(chosen);
  }
  if (field.kind === 'flag') return isOn(field, design) ? t('result.yes') : undefined;
  if (field.kind === 'oneOf' || field.derived) return undefined;
  if (field.kind === 'lines') return value && linesOf(field, value).map((line) => listed(line.split('  ').map((number, index) => withUnit(number, field.columns[index].unit)))).join(t('list.semicolon'));
  // One for each contact, which the form has no fields for.
  if (value !== null && typeof value === 'object') return listed(Object.entries(value).map(([contact, each]) => `${t(`part.${contact}`).toLowerCase()} ${withUnit(String(each), field.unit)}`));
  const shown = value ?? field.preset;
  return typeof shown === 'number' ? withUnit(String(shown), field.unit) : undefined;
}

/** Of fields of kinds and alternatives, only what a document gives: their presets are for when they are chosen. */
const optional = (group) => new Set((group.parts ?? [group]).flatMap(({ fields }) => fields).flatMap((field) => field.options ?? []).flatMap((option) => option.fields ?? option.field ?? []));

/** Units of the deviations of single items. */
const LISTS = { tooth_radius_um: 'µm', slot_angle_arcsec: '″', slot_wall_um: 'µm', ring_space_um: 'µm', ring_space_angle_arcsec: '″', wave_generator_lobe_um: 'µm' };

/** What single items deviate by: how many there are, from the least to the largest. */
function shownList(name, design) {
  const values = at(design, `/deviations/${name}`);
  if (!Array.isArray(values) || values.length === 0) return undefined;
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const range = { count: values.length, least: number(least), most: withUnit(number(most), LISTS[name]) };
  return least === most ? t('report.list_of_one', range) : t('report.list', range);
}

/** The inputs in which two designs differ: `[{ pointer, label, value, reference }]`, in words; what is left out is `–`. */
export function inputDifferences(design, reference) {
  const found = [];
  for (const group of GROUPS) {
    const onlyGiven = optional(group);
    for (const field of fieldsOf(group)) {
      const [value, other] = [design, reference].map((each) => (onlyGiven.has(field) && at(each, field.pointer) === undefined ? undefined : shownValue(field, each)));
      if (value !== other) found.push({ pointer: field.pointer, label: fullLabel(field), value: value ?? DASH, reference: other ?? DASH });
    }
  }
  for (const name of Object.keys(LISTS)) {
    const [one, other] = [design, reference].map((each) => at(each, `/deviations/${name}`));
    if (JSON.stringify(one ?? []) === JSON.stringify(other ?? [])) continue;
    found.push({ pointer: `/deviations/${name}`, label: t(`label./deviations/${name}`), value: shownList(name, design) ?? DASH, reference: shownList(name, reference) ?? DASH });
  }
  return found;
}

/** The report on a design, compared with a `reference` by name; of one that cannot exist, `reasons` why, `{ title, detail, label }`, in place of its numbers. */
export function reportOf(name, { design, version, reference, reasons }, address) {
  const groups = GROUPS.filter((group) => !group.parts).map((group) => {
    const onlyGiven = optional(group);
    const rows = fieldsOf(group)
      .filter((field) => !onlyGiven.has(field) || at(design, field.pointer) !== undefined)
      .map((field) => [field.label, shownValue(field, design)])
      .concat(group.pointer === '/deviations' ? Object.keys(LISTS).map((name) => [t(`label./deviations/${name}`), shownList(name, design)]) : [])
      .filter(([, value]) => value !== undefined)
      .map(([label, value]) => html('tr', {}, html('th', {}, label), html('td', {}, value)));
    return rows.length ? html('table', {}, html('caption', {}, group.title), html('tbody', {}, rows)) : undefined;
  });
  const materials = GROUPS.find((group) => group.pointer === '/materials');
  const materialRows = materials.parts.map(({ title, part, fields }) =>
    html('tr', {}, html('th', {}, title), html('td', {}, [titleOf(materialsOf(design, part)), fields.map((field) => shownValue(field, design)).join(', ν\u00a0')].filter(Boolean).map((text, index) => [index > 0 && html('br', {}), text]).flat())),
  );
  // Few designs give them, but then up to eight: lines across the page take less of it than a table.
  const made = GROUPS.find((group) => group.pointer === '/parts');
  const given = made.parts
    .map(({ title, fields }) => [title, fields.filter((field) => shownValue(field, design)).map((field) => `${field.label.toLowerCase()} ${shownValue(field, design)}`)])
    .filter(([, values]) => values.length > 0)
    .map(([title, values]) => labelled(title, listed(values)));
  return [
    html('h1', {}, name),
    html(
      'p',
      { class: 'imprint' },
      version ? t('report.calculated', { date: new Date().toISOString().slice(0, 10), version }) : t('report.printed', { date: new Date().toISOString().slice(0, 10) }),
      reference && version ? t('report.compared', { name: reference }) : '',
      ' · ',
      html('a', { href: address }, t('report.on_line', { address: address.split('#')[0] })),
    ),
    reasons.length > 0 && html('div', { class: 'report-reasons' }, html('h2', {}, sentence(reasons[0].title)), html('ul', {}, reasons.map(({ label, detail }) => html('li', {}, label ? labelled(label, detail) : detail)))),
    html('div', { class: 'report-design' }, groups.filter(Boolean), html('table', {}, html('caption', {}, materials.title), html('tbody', {}, materialRows))),
    given.length > 0 ? html('p', { class: 'report-parts' }, html('b', {}, `${sentence(made.title)} `), given.map(sentence).join(' ')) : '',
  ].filter(Boolean);
}

/** Findings of one kind share a title and an advice, and each has its line; what they mean stands below where few have to share
 *  the page. */
export function findingsTable(findings) {
  const kinds = new Map();
  for (const finding of findings) kinds.set(finding.code, [...(kinds.get(finding.code) ?? []), finding]);
  const head = [t('report.finding'), t('report.here'), t('report.limit'), t('explanation.change')].map((text) => html('th', { scope: 'col' }, text));
  const bodies = [...kinds.values()].map((kind) => {
    const [first] = kind;
    const rows = kind.map((finding) => {
      const { value, limit, unit } = finding;
      const where = contactOf(finding)?.name.toLowerCase();
      return html(
        'tr',
        {},
        finding === first && html('th', { scope: 'rowgroup', rowspan: kind.length }, kindOfFinding(first)),
        html('td', {}, where && `${where} `, html('b', { class: 'number' }, withUnit(number(value, 5), unit))),
        html('td', {}, html('span', { class: 'number' }, withUnit(number(limit, 5), unit)), finding === first && html('span', { class: 'basis' }, sourceOf(first))),
        finding === first && html('td', { rowspan: kind.length }, sentence(first.advice)),
      );
    });
    const meaning = html('tr', { class: 'meaning' }, html('td', { colspan: 4 }, [...new Set(kind.map(meaningOf))].join(' ')));
    return html('tbody', { class: first.severity }, rows, meaning);
  });
  return findings.length > 0 ? [html('thead', {}, html('tr', {}, head)), ...bodies] : [];
}
