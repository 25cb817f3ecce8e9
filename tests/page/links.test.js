// Links, files and names: which of them hold a design, and messages for others.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, afterEach, before, test } from 'node:test';
import { choose, designOf, enter, field, firstDesign, pick, setDocument, settled, testBed } from './harness.js';

const RADIUS = '/drive/teeth/radius_mm';
const bed = testBed({ before, after, afterEach });

const hash = (page) => page.evaluate(() => location.hash);

async function linkOf(page) {
  await pick(page, '#copy-link');
  return hash(page);
}

test('truncated link reports it and keeps its address', async () => {
  let page = await bed.open();
  await enter(page, RADIUS, 4.5);
  const whole = await linkOf(page);
  for (const cut of [whole.slice(0, -40), '#design=', '#desig']) {
    await page.context().close();
    page = await bed.open({ address: cut, hasClock: true });
    assert.match(await page.textContent('#notice'), /damaged or was cut short.*An example is shown instead/);
    const { drive, load } = await bed.server.example('paper-5.1');
    assert.deepEqual(await designOf(page), firstDesign({ drive, load }));
    // Waits longer than the page delays its address after a change.
    await page.clock.fastForward(10_000);
    await settled(page);
    assert.equal(await hash(page), cut);
  }
  await page.click('#notice-hide');
  assert.ok(await page.isHidden('#notice'));
  await enter(page, RADIUS, 4.25);
  await page.waitForFunction((old) => location.hash !== old, '#desig');
});

test('link with truncated reference shows its design', async () => {
  let page = await bed.open();
  await page.click('#keep');
  await enter(page, RADIUS, 4.5);
  const cut = (await linkOf(page)).slice(0, -30);
  await page.context().close();
  page = await bed.open({ address: cut });
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 4.5);
  assert.match(await page.textContent('#notice'), /but its reference cannot be read/);
  assert.ok(await page.isHidden('#comparing'));
});

test('link of version 0.1 opens', async () => {
  const address = '#design=' + Buffer.from(JSON.stringify({ drive: { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { count: 28, radius_mm: 5, width_mm: 15 }, ring: { teeth: 26 } }, load: { input_torque_nm: 20 } })).toString('base64url');
  const page = await bed.open({ address });
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 5);
  assert.ok(await page.isHidden('#notice'));
});

test('skip links move focus and keep the address', async () => {
  const page = await bed.open();
  const address = await linkOf(page);
  await page.evaluate(() => document.activeElement.blur());
  for (const [index, target] of [[0, 'form'], [1, 'table-title']]) {
    await page.locator('.skip').nth(index).focus();
    await page.keyboard.press('Enter');
    assert.equal(await page.evaluate(() => document.activeElement.id), target);
    assert.equal(await hash(page), address);
  }
});

test('different designs have different file names', async () => {
  const page = await bed.open();
  const names = new Set();
  const saved = async () => {
    const [download] = await Promise.all([page.waitForEvent('download'), pick(page, '#save')]);
    return { name: download.suggestedFilename(), buffer: await readFile(await download.path()) };
  };
  assert.equal((await saved()).name, 'the-papers-case-5.1.json', 'a ready design needs no more');
  for (const radius of [4.5, 4.6, 4.7]) {
    await enter(page, RADIUS, radius);
    names.add((await saved()).name);
  }
  assert.equal(names.size, 3);
  for (let round = 0; round < 3; round += 1) {
    const { name, buffer } = await saved();
    assert.match(name, /^the-papers-case-5\.1(-changed)?-[0-9a-f]{6}\.json$/);
    await page.setInputFiles('#document-file', { name, mimeType: 'application/json', buffer });
    await settled(page);
    assert.equal(await page.textContent('#design-name'), round === 0 ? 'The paper\'s case 5.1 (changed)' : 'the-papers-case-5.1', 'as it was loaded');
    if (round === 0) await choose(page, 'paper-5.2');
    if (round === 0) await page.setInputFiles('#document-file', { name, mimeType: 'application/json', buffer });
    await settled(page);
  }
  // The order of fields does not change the design.
  const design = await designOf(page);
  const before = (await saved()).name;
  await setDocument(page, Object.fromEntries(Object.entries(design).reverse()));
  assert.equal((await saved()).name.match(/[0-9a-f]{6}\.json$/)[0], before.match(/[0-9a-f]{6}\.json$/)[0]);
});

test('file without design is shown with the reason', async () => {
  const page = await bed.open();
  await page.setInputFiles('#document-file', { name: 'broken.json', mimeType: 'application/json', buffer: Buffer.from('{ "drive": ') });
  await page.waitForSelector('#document-error:not([hidden])');
  assert.match(await page.textContent('#document-error'), /not JSON/);
  assert.equal(await page.inputValue('#document-text'), '{ "drive": ');
});

test('field given twice is refused as by the service', async () => {
  const page = await bed.open();
  const before = await designOf(page);
  const buffer = Buffer.from(JSON.stringify(before).replace('"radius_mm":', '"radius_mm":9,"radius_mm":'));
  await page.setInputFiles('#document-file', { name: 'twice.json', mimeType: 'application/json', buffer });
  await page.waitForSelector('#document-error:not([hidden])');
  assert.match(await page.textContent('#document-error'), /radius_mm.*twice/);
  await page.click('#document-close');
  assert.deepEqual(await designOf(page), before);
});

test('STEP and CSV files equal the API’s answers', async () => {
  const page = await bed.open();
  await enter(page, RADIUS, 4.5);
  const design = await designOf(page);
  for (const [file, path, accept] of [
    ['ring.step', '/v1/drawings/ring', 'model/step'],
    ['states.csv', '/v1/sweep', 'text/csv'],
    ['profiles.csv', '/v1/geometry', 'text/csv'],
  ]) {
    const [download] = await Promise.all([page.waitForEvent('download'), pick(page, `[data-file="${file}"]`)]);
    assert.ok(download.suggestedFilename().endsWith(`-${file}`));
    // A STEP file may contain its time.
    const plain = (bytes) => bytes.toString().replace(/\d{4}-\d\d-\d\dT[\d:]+/g, '');
    assert.equal(plain(await readFile(await download.path())), plain(await bed.server.file(path, design, accept)), file);
  }
  assert.equal(await page.inputValue(field(RADIUS)), '4.5');
});
