// The page's languages: no text is missing in any, and in Chinese no English is left.

import assert from 'node:assert/strict';
import { readFile, readdir } from 'node:fs/promises';
import { after, afterEach, before, test } from 'node:test';
import { fieldsOf } from '../../src/service/page/field.js';
import { GROUPS } from '../../src/service/page/fields.js';
import { GROUPS as REQUIREMENTS } from '../../src/service/page/requirements.js';
import { TEXTS as EN } from '../../src/service/page/texts.en.js';
import { SERVICE, TEXTS as ZH } from '../../src/service/page/texts.zh-cn.js';
import { pick, setDocument, settled, testBed } from './harness.js';

const PAGE = new URL('../../src/service/page/', import.meta.url);
const bed = testBed({ before, after, afterEach });

const entries = (texts, prefix = '') => Object.entries(texts).flatMap(([key, text]) => (typeof text === 'string' ? [[prefix + key, text]] : entries(text, `${prefix}${key}.`)));
const at = (texts, key) => key.split('.').reduce((group, name) => group?.[name], texts);
const namesIn = (text) => [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name).sort();

test('languages have the same keys with the same values', () => {
  const [english, chinese] = [EN, ZH].map((texts) => entries(texts).map(([key, text]) => [key, namesIn(text)]));
  assert.deepEqual(chinese.toSorted(), english.toSorted());
  assert.deepEqual(entries(ZH).filter(([, text]) => text === ''), []);
});

test('every key that the page names has a text', async () => {
  const names = (await readdir(PAGE)).filter((name) => /\.(js|html)$/.test(name) && !name.startsWith('texts.'));
  const missing = [];
  let count = 0;
  for (const name of names) {
    const source = await readFile(new URL(name, PAGE), 'utf8');
    const called = source.matchAll(/\b(?:t|parts|textOf|counted)\((['`])(.+?)\1/g);
    const marked = source.matchAll(/data-(?:text|label|title)=(")(.+?)"/g);
    for (const [, , key] of [...called, ...marked]) {
      count += 1;
      // Of a key that ends with a value, what stands before it.
      const group = key.split('${')[0].replace(/[^.]*$/, '').slice(0, -1);
      if (!at(EN, key.includes('${') ? group : key)) missing.push(`${name}: ${key}`);
    }
  }
  assert.ok(count > 400, `${count} keys`);
  assert.deepEqual(missing.filter((line) => !line.startsWith('texts.js')), []);
});

test('every field, option and group has a text', () => {
  assert.doesNotMatch(JSON.stringify([GROUPS, REQUIREMENTS]), /"(label|option|group|hint|name|part)\./);
});

test('every code, quantity, example and material has Chinese texts', async () => {
  const { schemas } = JSON.parse(await readFile(new URL('../../openapi/openapi.json', import.meta.url), 'utf8')).components;
  const listed = async (name) => (await (await fetch(`${bed.server.origin}/v1/${name}`)).json())[name].map((item) => item.name);
  const wanted = [
    [schemas.FindingCode.enum, ZH.finding],
    [schemas.FindingCode.enum, SERVICE.findings],
    [schemas.ProblemCode.enum, SERVICE.titles],
    [schemas.ProblemCode.enum, SERVICE.reasons],
    [schemas.FieldCode.enum, SERVICE.reasons],
    [schemas.NoAnswerCode.enum, SERVICE.titles],
    [schemas.Beyond.enum, ZH.error.beyond],
    [schemas.HeldCase.enum, ZH.error.held],
    [schemas.Backing.enum, ZH.result.backing],
    [await listed('quantities'), ZH.quantity],
    [await listed('examples'), SERVICE.examples],
    [await listed('materials'), SERVICE.materials],
  ];
  for (const [codes, texts] of wanted) assert.deepEqual(codes.filter((code) => !texts[code]), []);
});

/** Names, units and words of the document, which are the same in every language. */
const SAME = /\b(toothwave|English|Palmgren|Johnson|Archard|Ctrl|Shift|arcmin|deg|rad|min|convert)\b|“Research.*drives”|Wang Su.*Chunyan|docs\/\S+|http:\S+|\/[a-z]\w*\/\w+/g;

/** Kinds and their fields that have no text yet: the page shows their names in the document. */
const BY_NAME = new Set(
  GROUPS.flatMap(fieldsOf).filter(({ kind }) => kind === 'variant').flatMap(({ pointer, options }) =>
    options.flatMap(({ value, label, fields }) => [!at(EN, `option.${pointer}.${value}`) && label, ...fields.map((inner) => !at(EN, `label.${inner.pointer}`) && inner.label)]),
  ).filter(Boolean),
);

/** What stands in the page as text, or as the name of something, and still has English words. */
async function english(page, within) {
  const texts = await page.$$eval(within, (roots) => {
    const named = (element) => ['aria-label', 'title', 'placeholder', 'aria-valuetext'].map((name) => element.getAttribute(name));
    const own = (element) => [...element.childNodes].filter(({ nodeType }) => nodeType === Node.TEXT_NODE).map(({ data }) => data);
    return roots.flatMap((root) => [root, ...root.querySelectorAll('*')]).flatMap((element) => [...named(element), ...own(element)]);
  });
  return [...new Set(texts)].filter((text) => !BY_NAME.has(text) && /[a-z]{3}/.test(text?.replace(SAME, '') ?? ''));
}

const CASE = { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { count: 28, radius_mm: 5, width_mm: 15 }, ring: { teeth: 26 } };
const CHINESE = { locale: 'zh-CN', example: null };

test('Chinese page has no English left', async () => {
  const page = await bed.open(CHINESE);
  assert.equal(await page.getAttribute('html', 'lang'), 'zh-CN');
  await page.click('#keep');
  const friction = { wave_generator: { kind: 'race', coefficient: 0.05, bearing_coefficient: 0.002, bearing_radius_mm: 57 }, ring: { coefficient: 0.3 }, carrier: { coefficient: 0.05 } };
  const load = { input_torque_nm: 200, input_speed_rpm: 1500, allowable_stress_mpa: 500 };
  await setDocument(page, { drive: { ...CASE, teeth: { ...CASE.teeth, radius_mm: 6.9 } }, load, friction, sweep: { wind_up: true }, parts: { ring: { rim: 'free' } } });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.ok((await page.locator('#findings .note').count()) >= 3);
  assert.deepEqual(await english(page, 'body > :not(noscript)'), []);
  // A design that cannot exist.
  await setDocument(page, { drive: { ...CASE, ring: { teeth: 27 } }, load: { input_torque_nm: -1 } });
  assert.match(await page.textContent('#impossible'), /该设计不可能实现/);
  assert.deepEqual(await english(page, 'body > :not(noscript)'), []);
});

test('views of studies are Chinese', async () => {
  const page = await bed.open(CHINESE);
  for (const view of ['explore', 'sensitivity', 'tolerance', 'find']) {
    await page.click(`#views [data-view="${view}"]`);
    await page.waitForFunction((id) => id === 'find' || id === 'tolerance' || document.querySelector(`#${id} .study-progress`).hidden, view);
    assert.deepEqual(await english(page, `#${view}`), [], view);
  }
});

test('unknown code is told in English', async () => {
  const page = await bed.open(CHINESE);
  const told = await page.evaluate(async () => {
    const { detailOf, findingInWords, titleOfCode } = await import('/page/words.js');
    const known = detailOf({ code: 'flat_too_long', detail: 'the flats are too long', value: 12, limit: 10 });
    return [known, detailOf({ code: 'new_code', detail: 'a length of 1.23456789 mm' }), findingInWords({ code: 'new_code', detail: 'why', advice: 'what' }).advice, titleOfCode('new_code')];
  });
  assert.deepEqual(told, [`${SERVICE.reasons.flat_too_long}（现为 12，界限 10）`, 'a length of 1.23457 mm', 'what', 'new code']);
});

test('chosen language is remembered, the design stays', async () => {
  const page = await bed.open();
  const lang = () => page.getAttribute('html', 'lang');
  assert.equal(await lang(), 'en');
  const torque = await page.inputValue('#field-load-input_torque_nm');
  await pick(page, '#language');
  await page.waitForFunction(() => document.documentElement.lang === 'zh-CN' && document.querySelector('#mechanism-title').textContent !== '');
  await settled(page);
  assert.equal(await page.textContent('#mechanism-title'), ZH.mechanism.title);
  assert.equal(await page.inputValue('#field-load-input_torque_nm'), torque);
  await page.reload();
  await settled(page);
  assert.equal(await lang(), 'zh-CN');
});
