// What a reader of the results must not misread: at which load they hold, what limits them, what a remedy or a reference did.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { designOf, enter, field, notes, pick, setDocument, settled, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });
const RADIUS = '/drive/teeth/radius_mm';
const FIRST = { example: null };
const tile = (page, name) => page.locator('#key-figures .tile:visible', { hasText: name });
const material = (page, part) => page.locator(`select[aria-label="${part}: fill in a material"]`);

test('line above the tiles names the load', async () => {
  const page = await bed.open(FIRST);
  assert.match(await page.textContent('#load-line'), /^At 20.N·m input torque \(280.N·m at the output\)$/);
  const { load, ...others } = await designOf(page);
  assert.ok(load);
  const duty = [10, 30].map((input_torque_nm) => ({ input_torque_nm, input_speed_rpm: 1500, share_of_time: 0.5 }));
  await setDocument(page, { ...others, load: { duty } });
  assert.match(await page.textContent('#load-line'), /^At the hardest load of the duty: 30.N·m/);
});

test('value beyond its limit is marked', async () => {
  const page = await bed.open(FIRST);
  const marked = () => page.$$eval('#key-figures .tile:not([hidden]):has([data-state=problem]) dt', (names) => names.map((name) => name.textContent));
  assert.deepEqual(await marked(), []);
  await enter(page, '/load/input_torque_nm', 60);
  assert.deepEqual(await marked(), ['Largest stress', 'Torque capacity', 'Safety of the fingers']);
  assert.match(await page.locator('#table data[data-state=problem]').first().evaluate((value) => getComputedStyle(value, '::before').content), /▲/);
});

test('clearances have their group and their sums', async () => {
  const page = await bed.open(FIRST);
  await enter(page, '/parts/teeth/clearance_um', 10);
  await enter(page, '/parts/ring/clearance_um', 5);
  await page.click('summary:has-text("Modification")');
  await enter(page, '/modification/slot_wall_um', 3);
  const group = page.locator('#form .group', { has: page.locator('h3', { hasText: /^Clearances$/ }) });
  assert.match(await group.textContent(), /wave generator 10.µm, ring 15.µm, slot wall 13.µm/);
  assert.equal(await group.locator('summary .summary').textContent(), '2 given');
  assert.equal(await page.locator('#form summary', { hasText: 'Parts as they are made' }).locator('.summary').textContent(), '1 given', 'the strength of the carrier');
  const helps = await page.evaluate(async () => {
    const { explanationOf } = await import('/page/field.js');
    return ['wave_generator', 'ring', 'carrier', 'teeth'].map((part) => explanationOf(`/parts/${part}/clearance_um`));
  });
  assert.equal(new Set(helps).size, 4);
});

test('estimated compliance stands in its fields and is kept', async () => {
  const page = await bed.open(FIRST);
  await setDocument(page, { drive: (await designOf(page)).drive, load: { input_torque_nm: 20 }, model: { series_compliance_mm_per_n: 'estimated' } });
  const { sweep } = await bed.server.answers(await designOf(page));
  const [ring, carrier] = ['ring', 'carrier'].map((contact) => Number(sweep.series_compliance_estimates.find((each) => each.contact === contact && each.is_as_held).compliance_mm_per_n.toPrecision(3)));
  await page.click('summary:has-text("Compliance of the supports")');
  const series = '/model/series_compliance_mm_per_n';
  assert.deepEqual(await Promise.all(['wave_generator', 'ring', 'carrier'].map((contact) => page.getAttribute(field(`${series}/${contact}`), 'placeholder'))), ['0', String(ring), String(carrier)]);
  await page.click('#more');
  assert.equal(await page.locator('button[aria-label$="take over as series compliance"] >> visible=true').count(), 0);
  assert.match(await page.textContent('#table'), /Forces include it/);
  await enter(page, `${series}/wave_generator`, '1e-6');
  assert.deepEqual((await designOf(page)).model.series_compliance_mm_per_n, { wave_generator: 1e-6, ring, carrier });
});

test('estimate keeps the compliance that is given elsewhere', async () => {
  const page = await bed.open();
  const parts = { carrier: { fingers: 'held_at_one_end' } };
  await setDocument(page, { drive: (await designOf(page)).drive, load: { input_torque_nm: 20 }, parts, model: { series_compliance_mm_per_n: { wave_generator: 1e-6 } } });
  await page.click('#more');
  await page.click('button[aria-label="Finger held at one end: take over as series compliance"]');
  await settled(page);
  const { carrier, ...others } = (await designOf(page)).model.series_compliance_mm_per_n;
  assert.ok(carrier > 1e-6);
  assert.deepEqual(others, { wave_generator: 1e-6 });
});

test('tiles keep their notes beside a reference', async () => {
  const page = await bed.open(FIRST);
  await page.click('#keep');
  await enter(page, '/load/input_torque_nm', 30);
  assert.match(await tile(page, 'Largest stress').textContent(), /\+\d.*ring, ψ/);
  assert.match(await tile(page, 'Torque capacity').textContent(), /=limited by ring contact/);
  assert.match(await tile(page, 'Torsional stiffness').textContent(), /kN·m\/rad.*smallest; largest/);
});

test('design is shown before the materials arrive', async () => {
  const page = await bed.open(FIRST);
  let release;
  const released = new Promise((resolve) => (release = resolve));
  await page.route('**/v1/materials', (route) => released.then(() => route.continue()));
  await page.reload();
  await settled(page);
  assert.equal(await material(page, 'Ring').isHidden(), true);
  release();
  await material(page, 'Ring').locator('option[value=bronze]').waitFor({ state: 'attached' });
});

test('material is recognised by its numbers', async () => {
  const page = await bed.open(FIRST);
  await page.click('summary:has-text("Materials")');
  await material(page, 'Ring').selectOption('bronze');
  await settled(page);
  assert.equal(await material(page, 'Ring').inputValue(), 'bronze');
  const note = /No allowable stress is published for Bearing bronze.*\(ring\); 1500.MPa is an assumption\./;
  for (const place of ['#findings', '#table']) assert.match(await page.textContent(place), note);
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.match(await page.textContent('#report'), /Bearing bronze/);
  // Two steels share their numbers.
  await material(page, 'Ring').selectOption('case-hardened-steel');
  await settled(page);
  assert.equal(await material(page, 'Ring').inputValue(), 'case-hardened-steel');
  const { materials, ...others } = await designOf(page);
  await setDocument(page, { ...others, materials: { carrier: materials.ring } });
  assert.equal(await material(page, 'Carrier').inputValue(), '');
  await setDocument(page, { ...others, materials });
  assert.equal(await material(page, 'Ring').inputValue(), '', 'the choice was that of another document');
  assert.doesNotMatch(await page.textContent('#findings'), note);
});

test('slots without wall come first, as an error', async () => {
  const page = await bed.open(FIRST);
  await enter(page, RADIUS, 6.9);
  const first = page.locator('#findings .note').first();
  assert.match(await first.textContent(), /^Slots run into each other/);
  assert.match(await first.getAttribute('class'), /problem/);
  assert.match(await page.textContent('#status-findings'), /findings: Slots run into each other/);
});

test('applied remedy tells what else it changed', async () => {
  const page = await bed.open(FIRST);
  await enter(page, RADIUS, 6.9);
  assert.equal(await page.locator('#form .finding', { hasText: 'Undercut ring tips' }).count(), 1, 'at the field to change first');
  await page.click(`${notes(RADIUS)} .remedy`);
  await settled(page);
  assert.match(await page.textContent('#effect'), /Undercut ring tips: gone\. Largest stress 1736\.9 → 2461\.4.MPa, torque capacity 22\.1\d* → 52\.4.N·m\./);
  await enter(page, RADIUS, 5);
  assert.ok(await page.isHidden('#effect'));
});

test('angles of both shafts have the ratio', async () => {
  const page = await bed.open(FIRST);
  for (const turns of [1, 2]) {
    await page.locator('#angle').fill('350');
    await page.locator('#play').click();
    await page.waitForFunction((least) => Number.parseFloat(document.querySelector('#angle-input').textContent) > least, 360 * turns);
    await page.locator('#play').click();
  }
  await settled(page);
  const [input, carrier] = await page.$$eval('#angle-input, #angle-carrier', (cells) => cells.map(({ textContent }) => Number.parseFloat(textContent)));
  assert.ok(input > 720 && Math.abs(input / carrier - 14) < 0.01, `${input}, ${carrier}`);
});

test('phone scrolls past the tiles and finds all results', async () => {
  const page = await bed.open({ ...FIRST, viewport: { width: 390, height: 844 } });
  await page.click('#to-table');
  assert.ok((await page.locator('#table-title').boundingBox()).y < 100);
  assert.ok(!(await page.locator('#key-figures').evaluate((tiles) => tiles.getBoundingClientRect().bottom > 0)));
  await page.click('#keep');
  await page.evaluate(() => document.querySelector('#clear').scrollIntoView());
  await page.click('#clear');
  assert.ok((await page.evaluate(() => scrollY)) > 300, 'not at the top');
});

test('definition covers no field of the form', async () => {
  const page = await bed.open(FIRST);
  await page.press(field(RADIUS), 'F1');
  const [shown, form] = await Promise.all(['#definition', '#form'].map((selector) => page.locator(selector).boundingBox()));
  assert.ok(shown.x >= form.x + form.width);
  await page.keyboard.press('Escape');
  await page.locator('#key-figures .term').first().click();
  assert.ok(Number.parseInt(await page.$eval('#definition dd', (text) => getComputedStyle(text).fontWeight), 10) < 500);
});

test('menu prints', async () => {
  const page = await bed.open(FIRST);
  await page.evaluate(() => {
    window.print = () => (document.title = 'printed');
  });
  await pick(page, '#print-page');
  assert.equal(await page.title(), 'printed');
});

test('found drive keeps the stresses of its contacts', async () => {
  const page = await bed.open(FIRST);
  const { load } = await page.evaluate(async () => {
    const { FIRST: requirements, withAllowables } = await import('/page/requirements.js');
    return withAllowables({ load: { output_torque_nm: 100, allowable_stress_mpa: 1500 } }, { find: { ...requirements.find, allowable_carrier_mpa: 770 } });
  });
  assert.deepEqual(load.allowable_stress_mpa, { wave_generator: 1500, ring: 1500, carrier: 770 });
});
