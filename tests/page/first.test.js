// A new user: first design, choices that change others, remedies, numbers as people type them.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { designOf, enter, field, firstDesign, notes, pick, resultOf, setDocument, settled, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });
const RADIUS = '/drive/teeth/radius_mm';

test('opens on the default model', async () => {
  const page = await bed.open({ example: null });
  const { drive, load } = await bed.server.example('paper-5.1');
  assert.deepEqual(await designOf(page), firstDesign({ drive, load }));
  const stress = () => resultOf(page, 'Contact stress, ring');
  const before = await stress();
  await enter(page, '/parts/ring/clearance_um', 10);
  const { sweep } = await bed.server.answers({ drive, load, model: { clearance: { ring_um: 10 } } });
  assert.equal(await stress(), sweep.peaks.ring.stress_mpa.value);
  assert.ok(Math.abs((await stress()) / before - 1) < 0.05, 'not the paper’s answer to it');
  assert.match(await page.textContent(`${field('/model/compatibility')} option[value=projection]`), /^As in the paper/);
});

test('first design tells what limits its torque', async () => {
  const page = await bed.open({ example: null });
  const tiles = () => page.textContent('#key-figures');
  assert.match(await tiles(), /Torque capacity663.\d.N·mlimited by ring contact at 1500.MPa/);
  assert.match(await tiles(), /Safety of the fingers[2-9].*far ends joined/);
  await page.click('summary:has-text("Parts as they are made")');
  await page.selectOption(field('/parts/carrier/strength'), 'c45-n');
  await page.selectOption(field('/parts/carrier/fingers'), 'held_at_one_end');
  await settled(page);
  assert.match(await tiles(), /limited by finger fatigue at safety 1/);
  assert.match(await tiles(), /Safety of the fingers.*held at one end/);
});

test('notice lists further changes made by a choice', async () => {
  const page = await bed.open({ example: null });
  await page.selectOption(field('/drive/wave_generator'), 'eccentric');
  await settled(page);
  assert.match(await page.textContent(notes('/drive/wave_generator')), /Also changed: ring teeth 26 → 27/);
  await page.click('#undo');
  await settled(page);
  assert.doesNotMatch(await page.textContent(notes('/drive/wave_generator')), /Also changed/);
  await page.selectOption(field('/model/compatibility'), 'projection');
  await settled(page);
  assert.match(await page.textContent(notes('/model/compatibility')), /Also changed: contact law Johnson, logarithmic → Linear, from the materials/);
});

const CASE_5_1 = { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { count: 28, radius_mm: 5, width_mm: 15 }, ring: { teeth: 26 } };
const LOAD = { input_torque_nm: 20 };
/** Designs by the finding whose remedy is a value. */
const REMEDIED = {
  undercut: { drive: { ...CASE_5_1, teeth: { ...CASE_5_1.teeth, radius_mm: 6.9 } }, load: LOAD },
  bore_shortens_flank: { drive: { ...CASE_5_1, ring: { teeth: 26, tip_radius_mm: 66.5 } }, load: LOAD },
  bore_without_effect: { drive: { ...CASE_5_1, ring: { teeth: 26, tip_radius_mm: 60 } }, load: LOAD },
  hollow_wave_generator: { drive: { wave_generator: { kind: 'harmonic_path', lobes: 3, mean_path_radius_mm: 60, amplitude_mm: 6.5 }, teeth: { count: 9, radius_mm: 7, width_mm: 15 }, ring: { teeth: 6 } }, load: LOAD },
  flat_cuts_the_contact: { drive: { ...CASE_5_1, teeth: { ...CASE_5_1.teeth, shape: 'flat_sided', flat_length_mm: 9.7 } }, load: LOAD },
  linear_law_too_stiff: { drive: CASE_5_1, load: LOAD, model: { compatibility: 'virtual_work', stiffness: { law: 'linear' }, clearance: { ring_um: 5 } } },
  palmgren_beyond_steel: { drive: CASE_5_1, load: LOAD, model: { stiffness: { law: 'palmgren' } }, materials: { ring: { youngs_modulus_gpa: 120 } } },
  projection_with_gap: { drive: CASE_5_1, load: LOAD, model: { compatibility: 'projection', clearance: { ring_um: 10 } } },
  stress_above_allowable: { drive: CASE_5_1, load: { ...LOAD, allowable_stress_mpa: 500 } },
};

test('button applies a remedy with a value', async () => {
  const page = await bed.open();
  const codes = async (design) => (await bed.server.answers(design)).sweep.findings.map(({ code }) => code);
  for (const [code, design] of Object.entries(REMEDIED)) {
    assert.ok((await codes(design)).includes(code), code);
    await setDocument(page, design);
    const count = (await codes(design)).filter((other) => other === code).length;
    const title = await page.evaluate(async (wanted) => (await import('/page/findings.js')).kindOf({ code: wanted }), code);
    await page.locator('#findings .note', { hasText: title }).first().locator('summary').click();
    await page.locator('#findings .note', { hasText: title }).first().locator('.remedy').click();
    await settled(page);
    assert.ok((await codes(await designOf(page))).filter((other) => other === code).length < count, `${code} is gone`);
  }
  // The field has the button too.
  await setDocument(page, REMEDIED.undercut);
  await page.click(`${notes(RADIUS)} .remedy`);
  await settled(page);
  assert.equal(await page.inputValue(field(RADIUS)), '6.74');
  assert.doesNotMatch(await page.textContent(notes(RADIUS)), /Undercut/);
});

test('new ratio stays and lists its consequences', async () => {
  const page = await bed.open({ example: null });
  await page.fill(field('/ratio'), '30');
  await page.press(field('/ratio'), 'Enter');
  await settled(page);
  assert.equal(await page.inputValue(field('/ratio')), '30', 'also where this drive cannot exist');
  assert.match(await page.textContent(notes('/ratio')), /Also changed: slots in theory 28 → 60, teeth installed 28 → 60, ring teeth 26 → 58/);
  await page.click(`${notes('/ratio')} button`);
  assert.ok(await page.isVisible('#find'));
  assert.equal(await page.inputValue(field('/find/ratio')), '30');
});

test('numbers are accepted as people type them', async () => {
  const page = await bed.open();
  for (const [text, value] of [['５，５', 5.5], ['5,5mm', 5.5], ['5.25 mm', 5.25], ['４．７５', 4.75], ['5 ㎜', 5]]) {
    await enter(page, RADIUS, text);
    assert.equal((await designOf(page)).drive.teeth.radius_mm, value, text);
  }
  for (const [pointer, text, value] of [['/load/input_torque_nm', '12 Nm', 12], ['/load/input_speed_rpm', '1500rpm', 1500], ['/parts/ring/clearance_um', '4 um', 4], ['/parts/ring/clearance_um', '3µm', 3]]) {
    await enter(page, pointer, text);
    assert.equal(pointer.split('/').slice(1).reduce((part, key) => part[key], await designOf(page)), value, text);
  }
  await enter(page, RADIUS, '0.5 cm');
  assert.match(await page.textContent(notes(RADIUS)), /not a number in mm/);
});

test('every field has explanation, every number a symbol', async () => {
  const page = await bed.open();
  const fields = await page.evaluate(async () => {
    const { GROUPS } = await import('/page/fields.js');
    const { explanationOf, fieldsOf } = await import('/page/field.js');
    return GROUPS.flatMap(fieldsOf).map(({ pointer, kind, symbol }) => ({ pointer, kind, symbol, text: explanationOf(pointer) }));
  });
  assert.ok(fields.length >= 90);
  assert.deepEqual(fields.filter(({ text }) => !text).map(({ pointer }) => pointer), []);
  assert.deepEqual(fields.filter(({ kind, symbol }) => kind === 'number' && !symbol).map(({ pointer }) => pointer), []);
  await page.click(`.field:has(> .entry ${field(RADIUS)}) .term`);
  assert.match(await page.textContent('.definition:popover-open'), /Tooth radius.*critical radius/s);
  await page.keyboard.press('Escape');
  await page.press(field('/drive/teeth/count'), 'F1');
  assert.match(await page.textContent('.definition:popover-open'), /Slots in theory/);
});

test('head has few buttons', async () => {
  const page = await bed.open({ viewport: { width: 1440, height: 900 } });
  const labels = await page.$$eval('.tools button', (buttons) => buttons.map((button) => button.getAttribute('aria-label') ?? button.textContent));
  assert.deepEqual(labels, ['Examples', 'Undo', 'Redo', 'Keep as reference', 'Download', 'Menu']);
  assert.ok((await page.locator('.top').boundingBox()).height < 70, 'one row');
  const formats = (selector) => page.$$eval(`#downloads ${selector}`, (buttons) => buttons.length);
  for (const format of ['step', 'dxf', 'svg', '3mf', 'stl', 'csv', 'comma\\.csv']) assert.ok((await formats(`[data-file$=\\.${format}]`)) > 0, format);
  await pick(page, '#print');
});

test('More shows residuals and depths', async () => {
  const page = await bed.open();
  const residual = page.locator('#table tr', { hasText: 'Torque balance, residual' });
  assert.ok(!(await residual.isVisible()));
  await page.click('#more');
  assert.ok(await residual.isVisible());
  assert.match(await page.locator('#table .group').first().textContent(), /^Peaks over a period/);
});

test('animation stops after three turns', async () => {
  const page = await bed.open({ hasClock: true });
  await page.click('#play');
  await page.clock.runFor(59_000);
  assert.equal(await page.textContent('#play'), 'Pause');
  await page.clock.runFor(3000);
  assert.equal(await page.textContent('#play'), 'Play');
});

test('animation stops out of sight', async () => {
  const page = await bed.open();
  await page.click('#play');
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
  await page.waitForFunction(() => document.querySelector('#play').textContent === 'Play');
});
