// Numbers as people type them, dependent counts, fields of kinds.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, designOf, enter, field, notes, settled, testBed } from './harness.js';

const RADIUS = '/drive/teeth/radius_mm';
const bed = testBed({ before, after, afterEach });

test('decimal comma is accepted unless ambiguous', async () => {
  const page = await bed.open();
  await enter(page, RADIUS, '5,5');
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 5.5);
  assert.equal(await page.inputValue(field(RADIUS)), '5.5', 'left, the field shows how it was read');
  await enter(page, RADIUS, '1,234');
  assert.match(await page.textContent(notes(RADIUS)), /1\.234 or 1234/);
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 5.5);
  assert.equal(await page.getAttribute(field(RADIUS), 'aria-invalid'), 'true');
  for (const [text, value] of [['0,125', 0.125], ['12,5e-1', 1.25], ['1\u202f000.5', 1000.5], ['−3', -3], ['.5', 0.5], ['5,', 5]]) {
    await enter(page, RADIUS, text);
    assert.equal((await designOf(page)).drive.teeth.radius_mm, value, text);
  }
  for (const text of ['five', '1.2.3', '5 mm', '1e999', '--5']) {
    await enter(page, RADIUS, text);
    assert.match(await page.textContent(notes(RADIUS)), /the last one stands/, text);
    assert.equal((await designOf(page)).drive.teeth.radius_mm, 5, text);
  }
});

test('page survives any number, small or large', async () => {
  const page = await bed.open();
  const fields = await page.$$eval('#form input[type=text]', (inputs) => inputs.filter((input) => input.checkVisibility() && !input.id.endsWith('-ratio')).map(({ id }) => id));
  assert.ok(fields.length >= 10);
  for (const id of fields) {
    for (const text of ['5e-324', '1.7e308', '-1', '1e-120']) await page.fill(`#${id}`, text);
    await page.keyboard.press('ArrowUp');
    await page.keyboard.press('ArrowDown');
    await settled(page);
    await page.click('#undo');
  }
  await choose(page, 'paper-5.2');
  assert.ok(await page.isHidden('#impossible'), 'and all is well with a design that is possible');
  assert.equal(await page.inputValue(field(RADIUS)), '1.5');
});

test('empty field says what it needs', async () => {
  const page = await bed.open();
  for (const [pointer, wanted] of [
    [RADIUS, /Required: tooth radius, a number in mm, such as 5/],
    ['/drive/teeth/count', /Required: slots in theory, a whole number, such as 28/],
    ['/load/input_torque_nm', /Required: input torque, a number in N·m/],
  ]) {
    await enter(page, pointer, '');
    assert.match(await page.textContent(notes(pointer)), wanted);
    assert.equal(await page.getAttribute(field(pointer), 'placeholder'), 'wanted');
    await page.click('#undo');
    await settled(page);
    assert.equal(await page.textContent(notes(pointer)), '');
  }
  // A field with a default may be empty during typing.
  await page.click('summary:has-text("Sweep and profile")');
  await page.fill(field('/sweep/samples'), '');
  await settled(page);
  assert.equal(await page.inputValue(field('/sweep/samples')), '');
  await page.locator(field('/sweep/samples')).blur();
  assert.equal(await page.inputValue(field('/sweep/samples')), '50');
});

test('another ratio changes the counts without an error', async () => {
  const page = await bed.open();
  const refusals = [];
  page.on('response', (response) => response.status() === 422 && refusals.push(response.url()));
  const ratio = field('/ratio');
  assert.equal(await page.inputValue(ratio), '14');
  await page.focus(ratio);
  for (const counts of [[30, 28], [32, 30]]) {
    await page.focus(ratio);
    await page.keyboard.press('ArrowUp');
    await settled(page);
    const { teeth, ring } = (await designOf(page)).drive;
    assert.deepEqual([teeth.count, ring.teeth], counts);
  }
  await page.fill(ratio, '-15');
  await page.keyboard.press('Enter');
  await settled(page);
  const { drive } = await designOf(page);
  assert.deepEqual([drive.teeth.count, drive.ring.teeth], [30, 32]);
  assert.equal((await bed.server.ask('/v1/geometry', await designOf(page))).transmission_ratio, -15);
  // With every second slot filled, this ratio is kept.
  await choose(page, 'paper-5.2');
  const before = (await bed.server.example('paper-5.2')).drive.teeth;
  assert.equal(before.count / before.installed, 2);
  await page.focus(ratio);
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('ArrowUp');
  await settled(page);
  const after = (await designOf(page)).drive.teeth;
  assert.deepEqual([after.count, after.installed], [before.count + 4, (before.count + 4) / 2]);
  assert.deepEqual(refusals, []);
  await page.fill(ratio, '1.5');
  await page.keyboard.press('Enter');
  assert.match(await page.textContent(notes('/ratio')), /whole number, 2 or more/);
});

test('only fields of the chosen kind are shown', async () => {
  const page = await bed.open();
  const found = await page.evaluate(async () => {
    const { Form } = await import('/page/form.js');
    const number = (pointer, label, start) => ({ kind: 'number', pointer, label, unit: 'mm', start });
    const mean = ({ drive }) => (drive.wave_generator.semi_major_mm + drive.wave_generator.semi_minor_mm) / 2;
    const groups = [
      {
        title: 'Wave generator',
        pointer: '/drive/wave_generator',
        open: true,
        fields: [
          number('/drive/wave_generator/width_mm', 'Width', 9),
          {
            kind: 'variant',
            pointer: '/drive/wave_generator',
            tag: 'kind',
            label: 'Kind',
            options: [
              { value: 'ellipse', label: 'Ellipse', implied: true, fields: [number('/drive/wave_generator/semi_major_mm', 'a'), number('/drive/wave_generator/semi_minor_mm', 'b')] },
              { value: 'harmonic', label: 'Harmonic', fields: [number('/drive/wave_generator/mean_mm', 'Mean', mean), number('/drive/wave_generator/amplitude_mm', 'Amplitude', 1)] },
              { value: 'eccentric', label: 'Eccentric', fields: [number('/drive/wave_generator/radius_mm', 'Radius', mean), number('/drive/wave_generator/amplitude_mm', 'Amplitude', 1)] },
            ],
          },
        ],
      },
    ];
    const container = document.createElement('form');
    container.id = 'kinds';
    document.body.append(container);
    const designs = [];
    const form = new Form(container, { onEdit: (design) => { designs.push(design); form.setDesign(design); }, onEnd() {} }, groups);
    form.setDesign({ drive: { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56, width_mm: 7 } } });
    const shown = () => [...container.querySelectorAll('.number-field')].filter((element) => element.checkVisibility()).map((element) => element.querySelector('label').textContent.trim());
    const select = container.querySelector('select');
    const result = [shown()];
    for (const kind of ['harmonic', 'eccentric', 'ellipse']) {
      select.value = kind;
      select.dispatchEvent(new Event('change'));
      result.push(shown());
    }
    container.remove();
    return { result, designs: designs.map(({ drive }) => drive.wave_generator) };
  });
  assert.deepEqual(found.result, [['Width', 'a', 'b'], ['Width', 'Mean', 'Amplitude'], ['Width', 'Radius', 'Amplitude'], ['Width', 'a', 'b']]);
  const [harmonic, eccentric, ellipse] = found.designs;
  assert.deepEqual(harmonic, { kind: 'harmonic', width_mm: 7, mean_mm: 57, amplitude_mm: 1 });
  assert.equal(eccentric.kind, 'eccentric');
  assert.deepEqual([eccentric.width_mm, eccentric.amplitude_mm, eccentric.mean_mm], [7, 1, undefined]);
  assert.deepEqual(ellipse, { width_mm: 7 }, 'the implied kind has no tag');
});
