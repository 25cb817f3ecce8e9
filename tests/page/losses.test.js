// Friction, speed, duty and wear: entered in the form, calculated, shown.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, designOf, enter, field, notes, resultOf, setDocument, settled, testBed } from './harness.js';

const KIND = '/friction/wave_generator';
const bed = testBed({ before, after, afterEach });

const open = async (group) => bed.page.$$eval('#form details.group', (all, title) => all.forEach((details) => { if (details.querySelector('h3').textContent === title) details.open = true; }), group);

async function pick(page, pointer, value) {
  await page.selectOption(field(pointer), value);
  await settled(page);
}

const near = (found, expected, what) => assert.ok(Math.abs(found - expected) <= 1e-9 * Math.abs(expected), `${what}: ${found}, not ${expected}`);

test('losses of three bearings are compared and applied', async () => {
  const page = await bed.open();
  await choose(page, 'paper-5.1');
  await page.click('#compare-losses');
  await page.waitForSelector('#losses-table tbody tr');
  const rows = await page.$$eval('#losses-table tbody tr', (lines) => lines.map((line) => ({ kind: line.dataset.kind, efficiency: Number(line.querySelector('data').value), text: line.textContent })));
  assert.deepEqual(rows.map(({ kind }) => kind), ['plain', 'race', 'rolling']);
  const [plain, race, rolling] = rows.map(({ efficiency }) => efficiency);
  assert.ok(plain < 0.55 && race > 0.85 && rolling > race, JSON.stringify(rows));
  assert.match(rows[0].text, /self-locking/);
  assert.match(await page.textContent('#losses-table caption'), /usual coefficients.*0\.05.*0\.002/);
  // The design does not change until a row is chosen.
  assert.equal((await designOf(page)).friction, undefined);
  assert.ok(await page.isHidden('#key-figures .tile:has-text("Efficiency")'));
  await page.click('#losses-table tr[data-kind="race"] button');
  await settled(page);
  assert.equal((await designOf(page)).friction.wave_generator.kind, 'race');
  near(await resultOf(page, 'Efficiency, ring fixed'), 100 * race, 'the row is the design');
  assert.match(await page.textContent('#key-figures .tile:has-text("Efficiency")'), /ring fixed; .* back-driven/);
  assert.equal(await page.getAttribute('#losses-table tr[data-kind="race"] button', 'aria-pressed'), 'true');
  await page.click('#compare-losses');
  await page.waitForFunction(() => document.querySelector('#losses-state').textContent === '');
  // Efficiencies depend on these.
  const compared = await designOf(page);
  for (const change of [{ deviations: { ring_runout: { amount_um: 7, angle_deg: 0 } } }, { parts: { carrier: { outer_radius_mm: 65 } } }]) {
    await setDocument(page, { ...compared, ...change });
    assert.match(await page.textContent('#losses-state'), /compare again/, JSON.stringify(change));
  }
  await setDocument(page, compared);
  assert.equal(await page.textContent('#losses-state'), '');
  await enter(page, '/drive/teeth/radius_mm', 5.2);
  assert.match(await page.textContent('#losses-state'), /compare again/);
});

test('form sets friction at all contacts or none', async () => {
  const page = await bed.open();
  await open('Friction and wear');
  const before = await designOf(page);
  await pick(page, KIND, 'plain');
  assert.deepEqual((await designOf(page)).friction, { wave_generator: { kind: 'plain', coefficient: 0.05 }, ring: { coefficient: 0.05 }, carrier: { coefficient: 0.05 } });
  await enter(page, `${KIND}/coefficient`, 0.03);
  await enter(page, '/friction/ring/coefficient', 0.04);
  await pick(page, KIND, 'race');
  const { friction } = await designOf(page);
  assert.deepEqual(friction, {
    wave_generator: { kind: 'race', coefficient: 0.03, bearing_coefficient: 0.002, bearing_radius_mm: 57 },
    ring: { coefficient: 0.04 },
    carrier: { coefficient: 0.05 },
  });
  await pick(page, KIND, 'none');
  assert.deepEqual(await designOf(page), before);
  assert.equal(await resultOf(page, 'Efficiency, ring fixed'), undefined);
});

test('results, plot, table and colours match the service', async () => {
  const page = await bed.open();
  const design = {
    ...(await bed.server.example('paper-5.1')),
    friction: {
      wave_generator: { kind: 'plain', coefficient: 0.03 },
      ring: { coefficient: 0.05 },
      carrier: { coefficient: 0.05 },
      wear_rate_mm3_per_nm: { wave_generator: 1e-7, ring: 1e-7, carrier: 1e-7 },
    },
    load: { input_torque_nm: 20, input_speed_rpm: 1500 },
  };
  assert.ok(await page.isHidden('#charts figure:has-text("Pressure times velocity")'));
  await setDocument(page, design);
  const { losses, states } = (await bed.server.answers(design)).sweep;
  near(await resultOf(page, 'Efficiency, ring fixed'), 100 * losses.efficiency.ring_fixed, 'efficiency');
  near(await resultOf(page, 'Power loss'), losses.power_loss_w, 'power');
  near(await resultOf(page, 'Share lost at the cam or race'), (100 * losses.loss_ratio_by_place.wave_generator) / losses.loss_ratio, 'share');
  near(await resultOf(page, 'Pressure times velocity, carrier'), losses.pressure_velocity_mpa_m_per_s.carrier.value, 'p·v');
  near(await resultOf(page, 'Wear, wave generator'), 1000 * losses.wear_mm_per_hour.wave_generator.value, 'wear');
  assert.ok(await page.isVisible('#charts figure:has-text("Pressure times velocity")'));
  // The curve has the peak of the service's answer.
  const peaks = await page.evaluate(
    async ({ asked, sweep }) => {
      const [{ passOf }, { drawable }] = await Promise.all([import('/page/pass.js'), import('/page/states.js')]);
      const { rubbing } = passOf(asked, drawable(sweep));
      return Object.fromEntries(Object.entries(rubbing).map(([key, values]) => [key, Math.max(...values)]));
    },
    { asked: design, sweep: (await bed.server.answers(design)).sweep },
  );
  for (const [contact, peak] of Object.entries(peaks)) near(peak, losses.pressure_velocity_mpa_m_per_s[contact].value, contact);
  assert.ok(states.tooth.length > 0);
  // Teeth can be coloured by it.
  const colours = () => page.$$eval('#whole .tooth', (teeth) => teeth.map(({ style }) => style.fill));
  const before = await colours();
  await page.selectOption('#legend select', 'rubbing');
  await settled(page);
  assert.notDeepEqual(await colours(), before);
  assert.match(await page.textContent('#legend'), /MPa m\/s/);
  // Without a speed it is missing, and stress gives the colours again.
  await enter(page, '/load/input_speed_rpm', '');
  assert.ok(await page.isHidden('#charts figure:has-text("Pressure times velocity")'));
  assert.match(await page.textContent('#legend'), /highest contact stress/);
  assert.equal(await resultOf(page, 'Power loss'), undefined);
});

test('each line of a duty is one load', async () => {
  const page = await bed.open();
  await enter(page, '/load/input_speed_rpm', 900);
  await pick(page, '/load', 'duty');
  assert.deepEqual((await designOf(page)).load, { duty: [{ input_torque_nm: 20, input_speed_rpm: 900, share_of_time: 1 }] });
  assert.ok(await page.isHidden(field('/load/input_speed_rpm')));
  await page.fill(field('/load/duty'), '10 1500 50\n40 N·m 300 30 %\n20  3000  20');
  await settled(page);
  const { duty } = (await designOf(page)).load;
  assert.deepEqual(duty, [
    { input_torque_nm: 10, input_speed_rpm: 1500, share_of_time: 0.5 },
    { input_torque_nm: 40, input_speed_rpm: 300, share_of_time: 0.3 },
    { input_torque_nm: 20, input_speed_rpm: 3000, share_of_time: 0.2 },
  ]);
  const alone = (await bed.server.answers({ ...(await designOf(page)), load: { input_torque_nm: 40 } })).sweep;
  assert.equal(await resultOf(page, 'Force, ring'), alone.peaks.ring.force_n.value, 'the peaks are those of the hardest');
  await page.fill(field('/load/duty'), '10 1500');
  assert.match(await page.textContent(notes('/load/duty')), /Line 1 needs 3 numbers/);
  await page.fill(field('/load/duty'), '10 1500 60');
  await settled(page);
  assert.match(await page.textContent(notes('/load/duty')), /add up to 0\.6/);
  await page.fill(field('/load/duty'), '10 1500 100');
  await settled(page);
  await pick(page, '/load', 'output_torque_nm');
  assert.deepEqual((await designOf(page)).load, { output_torque_nm: 140 });
});

test('eccentric’s bearing shows its life', async () => {
  const page = await bed.open();
  await choose(page, 'eccentric-roller');
  await open('Friction and wear');
  await pick(page, KIND, 'rolling');
  await enter(page, '/load/input_speed_rpm', 1000);
  await enter(page, `${KIND}/bearing_load_rating_n`, 9000);
  const { losses } = (await bed.server.answers(await designOf(page))).sweep;
  near(await resultOf(page, 'Life of the bearing'), losses.bearing.life_h, 'life');
  await choose(page, 'paper-5.1');
  await open('Friction and wear');
  await pick(page, KIND, 'rolling');
  await enter(page, `${KIND}/bearing_load_rating_n`, 9000);
  assert.match(await page.textContent(notes(`${KIND}/bearing_load_rating_n`)), /ISO 281/);
});

test('material fills in its numbers and their source', async () => {
  const page = await bed.open();
  await open('Materials');
  await page.selectOption('select[aria-label="Ring: fill in a material"]', 'pom');
  await settled(page);
  assert.deepEqual((await designOf(page)).materials.ring, { youngs_modulus_gpa: 3, poissons_ratio: 0.35 });
  assert.equal(await page.inputValue(field('/materials/ring/youngs_modulus_gpa')), '3');
  assert.match(await page.textContent('#form .filling:has(select[aria-label^="Ring"])'), /Engineering Plastics Handbook/);
});

test('report names losses of case 5.1', async () => {
  const page = await bed.open();
  const design = await bed.server.example('paper-5.1');
  await setDocument(page, { ...design, load: { ...design.load, input_speed_rpm: 1500 }, friction: { wave_generator: { kind: 'plain', coefficient: 0.03 }, ring: { coefficient: 0.05 }, carrier: { coefficient: 0.05 } } });
  await page.emulateMedia({ media: 'print' });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  const report = await page.textContent('#report');
  for (const part of ['the cam itself', 'Friction, teeth on the cam', '0.03', 'Input speed', '1500']) assert.ok(report.includes(part), part);
  assert.ok(await page.isVisible('#table tr:has-text("Efficiency, ring fixed")'));
  assert.ok(await page.isHidden('#losses'));
});
