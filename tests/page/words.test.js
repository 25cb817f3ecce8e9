// Introduction, definitions and differences for a new user.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, enter, field, pick, settled, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });

test('introduction has few sentences and can be hidden', async () => {
  const page = await bed.open();
  assert.match(await page.textContent('#intro p'), /wave generator, in the picture an ellipse, pushes loose teeth.*Change the design/);
  for (const label of ['Ring', 'Tooth', 'Carrier', 'Wave generator']) assert.ok((await page.textContent('.picture')).includes(label));
  // No label is truncated.
  const cut = await page.$$eval('.picture text', (texts) => texts.filter((text) => {
    const [own, whole] = [text.getBoundingClientRect(), text.ownerSVGElement.getBoundingClientRect()];
    return own.left < whole.left || own.right > whole.right;
  }).length);
  assert.equal(cut, 0);
  await page.click('#intro-hide');
  await page.reload();
  await settled(page);
  assert.ok(await page.isHidden('#intro'));
  await pick(page, '#help');
  await page.click('#help-intro');
  assert.ok(await page.isVisible('#intro'));
});

test('menu has help, API, save and load', async () => {
  const page = await bed.open();
  await page.click('[popovertarget=menu]');
  for (const id of ['#help', '#api', '#save', '#load']) assert.ok(await page.isVisible(id), id);
  await pick(page, '#help');
  const help = await page.textContent('#help-dialog');
  for (const word of ['Contact ratio', 'Position ψ', 'Slots in theory', 'Projection', 'Virtual work', 'Journal of Chongqing University 36(1), 2013']) assert.ok(help.includes(word), word);
  await page.keyboard.press('Escape');
  assert.ok(!(await page.isVisible('#help-dialog')));
});

test('words have definitions for mouse and keyboard', async () => {
  const page = await bed.open();
  const definition = page.locator('#definition');
  for (const [mark, wanted] of [
    ['#key-figures .term', /Contact ratio ε.*Position ψ/],
    ['.field:has(> .entry #field-drive-teeth-count) .term', /Slots in theory/],
    ['.field:has(> #field-model-compatibility) .term', /Projection.*Virtual work.*Journal of Chongqing/],
    ['#position-term .term', /Position ψ/],
  ]) {
    await page.click(mark);
    assert.match(await definition.textContent(), wanted);
    assert.ok(await definition.isVisible());
    const { x, y, width, height } = await definition.boundingBox();
    assert.ok(x >= 0 && y >= 0 && x + width <= 1366 && y + height <= 900, mark);
    await page.click(mark);
    assert.ok(!(await definition.isVisible()), `${mark} closes it`);
    await page.focus(mark);
    await page.keyboard.press('Enter');
    assert.ok(await definition.isVisible());
    await page.keyboard.press('Escape');
    assert.ok(!(await definition.isVisible()));
  }
});

test('comparison shows the inputs that differ', async () => {
  const page = await bed.open();
  await page.click('#keep');
  assert.equal(await page.textContent('#differing'), 'All inputs are the same.');
  await enter(page, '/load/input_torque_nm', 3);
  assert.match(await page.textContent('#differing'), /Inputs that differ: Input torque 20.N·m → 3.N·m\./);
  await page.selectOption(field('/model/compatibility'), 'virtual_work');
  await settled(page);
  const rows = await page.$$eval('#inputs tbody tr', (lines) => lines.map((line) => [...line.children].map((cell) => cell.textContent)));
  assert.deepEqual(rows, [['Input torque', '3\u202fN·m', '20\u202fN·m'], ['Compatibility', 'Virtual work', 'As in the paper (projection)']]);
  await page.click('#inputs button:has-text("Input torque")');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'field-load-input_torque_nm');
  await page.click('#clear');
  assert.equal(await page.textContent('#inputs'), '');
});

test('comparison scrolls in its box on small screens', async () => {
  const page = await bed.open({ viewport: { width: 768, height: 1024 } });
  await page.click('#keep');
  await enter(page, '/load/input_torque_nm', 3);
  const lines = await page.$$eval('#table.comparing tbody tr:not([hidden]) th[scope=row]', (labels) => labels.map((label) => ({ text: label.textContent, lines: label.clientHeight / parseFloat(getComputedStyle(label).lineHeight) })));
  assert.ok(lines.length > 20);
  assert.deepEqual(lines.filter((label) => label.lines > 3.5), []);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 768);
});

test('symbol j means only the wave generator’s angle', async () => {
  const page = await bed.open();
  await choose(page, 'paper-5.1');
  assert.match(await page.textContent('#readout caption'), /Δj = /);
  assert.match(await page.locator('#table tr', { hasText: 'Force, ring' }).textContent(), /j 8/);
});
