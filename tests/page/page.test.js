import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { readFile } from 'node:fs/promises';
import { after, afterEach, before, test } from 'node:test';
import { choose, designOf, enter, field, launch, notes, open, pick, resultOf, Server, setDocument as putDocument, settled } from './harness.js';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const RADIUS = '/drive/teeth/radius_mm';
const SEMI_MAJOR = '/drive/wave_generator/semi_major_mm';
const SEMI_MINOR = '/drive/wave_generator/semi_minor_mm';

let server;
let browser;
let page;

before(async () => {
  server = await Server.start();
  browser = await launch();
});

after(async () => {
  await browser?.close();
  await server?.stop();
});

afterEach(async () => {
  const faults = page?.faults ?? [];
  await page?.context().close();
  page = undefined;
  assert.deepEqual(faults, [], 'no console error, no violation of the policy, no request to elsewhere');
});

/** What the results must show, by label, from the answers themselves. */
function expected({ geometry, coincidence, sweep }) {
  const { peaks } = sweep;
  return {
    'Ratio, ring fixed': geometry.transmission_ratio,
    'Ratio, carrier fixed': geometry.transmission_ratio_carrier_fixed,
    'Ratio of ring to carrier, wave generator fixed': geometry.members.wave_generator_fixed.ratio,
    'Ring torque over input torque, ring fixed': geometry.members.ring_fixed.holding_torque_ratio,
    'Carrier torque over input torque, carrier fixed': geometry.members.carrier_fixed.holding_torque_ratio,
    'Wave generator torque over ring torque': geometry.members.wave_generator_fixed.holding_torque_ratio,
    'Period of the load pattern': geometry.period_deg,
    'Contact ratio': coincidence.coincidence_degree,
    'Fewest teeth in mesh': coincidence.teeth_in_mesh_per_zone.min,
    'Most teeth in mesh': coincidence.teeth_in_mesh_per_zone.max,
    'Engagement begins': geometry.engagement.start_deg,
    'Critical tooth radius': geometry.undercut.critical_tooth_radius_mm,
    'Force, wave generator': peaks.wave_generator.force_n.value,
    'Force, ring': peaks.ring.force_n.value,
    'Force, carrier': peaks.carrier.force_n.value,
    'Contact stress, wave generator': peaks.wave_generator.stress_mpa.value,
    'Contact stress, ring': peaks.ring.stress_mpa.value,
    'Contact stress, carrier': peaks.carrier.stress_mpa.value,
    ...Object.fromEntries(
      ['wave_generator', 'ring', 'carrier'].flatMap((contact) => {
        const name = contact.replace('_', ' ');
        const { half_width_mm, shear_stress_mpa, shear_depth_mm } = peaks[contact];
        return [[`Half-width of the contact, ${name}`, half_width_mm], [`Largest shear stress, ${name}`, shear_stress_mpa], [`Its depth, ${name}`, shear_depth_mm]];
      }),
    ),
    'Ring root radius': geometry.ring.root_radius_mm,
    'Ring tip radius': geometry.ring.tip_radius_mm,
    'Ring tooth height': geometry.ring.tooth_height_mm,
    'Largest pressure angle, ring': geometry.ring.pressure_angle_max_deg,
    'Largest pressure angle, cam': geometry.wave_generator.pressure_angle_max_deg,
    'Radial space for the carrier': geometry.carrier.radial_space_mm,
    'Thinnest wall between slots': geometry.carrier.slot_wall_mm,
    'Least gap between teeth': geometry.teeth.gap_min_mm,
    'Torque balance': sweep.checks.torque_balance_residual,
    'Period closure': sweep.checks.period_closure_residual,
  };
}

async function assertShows(design) {
  for (const [label, value] of Object.entries(expected(await server.answers(design)))) {
    assert.equal(await resultOf(page, label), value, label);
  }
}

async function violations(within = 'html') {
  await page.evaluate(await readFile(AXE, 'utf8'));
  const { violations: found } = await page.evaluate((selector) => window.axe.run(selector), within);
  return found.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join(' | ')}`);
}

test('every example loads with the service’s numbers', async () => {
  page = await open(browser, server);
  const { examples } = await (await fetch(`${server.origin}/v1/examples`)).json();
  assert.ok(examples.length >= 4);
  for (const { name } of examples) {
    await choose(page, name);
    assert.equal(await page.getAttribute(`[data-example="${name}"]`, 'aria-pressed'), 'true');
    // The mouse is still over it.
    const [color, background] = await page.$eval(`[data-example="${name}"]`, (button) => ['color', 'backgroundColor'].map((key) => getComputedStyle(button)[key]));
    assert.notEqual(color, background, 'a pressed button can be read');
    await assertShows(await server.example(name));
  }
});

test('numbers are rounded only for display', async () => {
  page = await open(browser, server);
  assert.match(await page.textContent('#key-figures'), /Largest force1549\.3.Nring, ψ 43\.7°/);
  assert.match(await page.textContent('#key-figures'), /Undercutnocritical r 6\.749.mm/);
});

test('dragged slider answers live, one step to undo', async () => {
  page = await open(browser, server);
  const slider = await page.$(`.field:has(${field(RADIUS)}) input[type=range]`);
  const box = await slider.boundingBox();
  const [middle, height] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(middle, height);
  await page.mouse.down();
  for (let step = 1; step <= 8; step += 1) {
    const before = await page.textContent('#key-figures');
    await page.mouse.move(middle - step * 6, height);
    // While the pointer is down, numbers follow and the picture stays.
    await page.waitForFunction((old) => document.querySelector('#key-figures').textContent !== old, before);
    assert.ok((await page.getAttribute('#whole .part-ring', 'd')).length > 1000);
  }
  await page.mouse.up();
  await settled(page);
  const design = await designOf(page);
  assert.ok(design.drive.teeth.radius_mm < 5);
  await assertShows(design);
  await page.click('#undo');
  await settled(page);
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 5);
  assert.ok(await page.isDisabled('#undo'));
});

test('newest design wins over slow older answers', async () => {
  page = await open(browser, server);
  let aborted = 0;
  page.on('requestfailed', (request) => (aborted += request.failure().errorText.includes('ABORTED') ? 1 : 0));
  await page.route('**/v1/design', async (route) => {
    const { radius_mm: radius } = route.request().postDataJSON().drive.teeth;
    // The older the design, the later its answer.
    await new Promise((resolve) => setTimeout(resolve, radius < 4.5 ? 0 : 3000));
    await route.continue().catch(() => undefined);
  });
  for (const radius of [4.9, 4.8, 4.7, 4.6, 4.4]) await page.fill(field(RADIUS), String(radius));
  await settled(page);
  await assertShows(await designOf(page));
  assert.ok(aborted > 0, 'stale requests are aborted');
  await page.unroute('**/v1/design');
});

test('impossible drive shows its reasons at the fields', async () => {
  page = await open(browser, server);
  await enter(page, SEMI_MINOR, 60);
  assert.match(await page.textContent(notes(SEMI_MAJOR)), /must exceed the semi-minor axis/);
  assert.equal(await page.getAttribute(field(SEMI_MAJOR), 'aria-invalid'), 'true');
  assert.match(await page.textContent('#impossible'), /The design is impossible/);
  assert.equal(await resultOf(page, 'Force, ring'), (await server.answers(await server.example('paper-5.1'))).sweep.peaks.ring.force_n.value);
  // All reasons appear at once at their fields, also in a folded group.
  await enter(page, '/drive/teeth/count', 31);
  await page.click('summary:has-text("Materials")');
  await enter(page, '/materials/ring/poissons_ratio', 0.7);
  for (const pointer of [SEMI_MAJOR, '/drive/ring/teeth', '/materials/ring/poissons_ratio']) {
    assert.ok((await page.textContent(notes(pointer))).length > 20, pointer);
  }
  await enter(page, '/materials/ring/poissons_ratio', 0.3);
  await enter(page, SEMI_MINOR, 56);
  // A reason whose limit would be enough offers it.
  await enter(page, '/drive/teeth/count', 30);
  await enter(page, '/drive/teeth/installed', '');
  await page.click(`${notes('/drive/ring/teeth')} button`);
  await settled(page);
  assert.ok(await page.isHidden('#impossible'));
  const design = await designOf(page);
  assert.equal(design.drive.ring.teeth, 28);
  assert.equal(design.drive.teeth.installed, undefined);
  await assertShows(design);
});

test('geometry needs no load, and load field says so', async () => {
  page = await open(browser, server);
  await page.fill(field('/load/input_torque_nm'), '');
  await settled(page);
  assert.match(await page.textContent(notes('/load')), /input_torque_nm/);
  assert.equal(await resultOf(page, 'Ring tip radius'), 66);
  assert.equal(await resultOf(page, 'Force, ring'), undefined);
  assert.equal(await page.getAttribute('#whole .arrow', 'd'), '');
});

test('case 5.1 with larger r shows undercut', async () => {
  page = await open(browser, server);
  assert.match(await page.textContent('.field:has(#field-drive-teeth-radius_mm) .mark-text'), /undercut from 6\.749 mm/);
  await enter(page, RADIUS, 6.74);
  assert.doesNotMatch(await page.textContent(notes(RADIUS)), /Undercut/);
  await enter(page, RADIUS, 6.8);
  const finding = page.locator(`${notes(RADIUS)} .finding`, { hasText: 'Undercut ring tips' });
  assert.equal(await finding.getAttribute('aria-expanded'), 'false');
  await finding.click();
  const explanation = await page.textContent(`${notes(RADIUS)} .note:has-text("Undercut") .explanation`);
  assert.match(explanation, /What is tested.*critical radius.*6\.8.mm, the limit is 6\.7492.mm/);
  assert.match(explanation, /Why it matters.*cut away/);
  assert.match(explanation, /What to change.*thinner/);
  assert.match(await page.textContent('#key-figures'), /Undercutyescritical r 6\.749.mm/);
  assert.match(await page.textContent('#findings'), /Undercut ring tips/);
  // The finding links to its other fields.
  await page.click(`${notes(RADIUS)} .explanation button:has-text("Semi-minor axis")`);
  assert.equal(await page.evaluate(() => document.activeElement.id), 'field-drive-wave_generator-semi_minor_mm');
});

test('buttons and keyboard undo and redo', async () => {
  page = await open(browser, server);
  await enter(page, RADIUS, 4.5);
  await page.locator(field(RADIUS)).blur();
  await choose(page, 'paper-5.2');
  await page.keyboard.press('Control+z');
  await settled(page);
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 4.5);
  assert.equal(await page.textContent('#design-name'), 'The paper\'s case 5.1 (changed)');
  await page.click('#undo');
  await settled(page);
  assert.deepEqual(await designOf(page), await server.example('paper-5.1'));
  await page.keyboard.press('Control+Shift+z');
  await page.click('#redo');
  await settled(page);
  const design = await designOf(page);
  assert.deepEqual(design, await server.example('paper-5.2'));
  await assertShows(design);
});

test('address holds design and reference', async () => {
  page = await open(browser, server);
  await page.click('#keep');
  await choose(page, 'paper-5.2');
  await enter(page, RADIUS, 1.25);
  await page.waitForFunction(() => {
    const parameters = new URLSearchParams(location.hash.slice(1));
    return parameters.has('reference') && atob(parameters.get('design').replaceAll('-', '+').replaceAll('_', '/')).includes('1.25');
  });
  const address = await page.evaluate(() => location.hash);
  const design = await designOf(page);
  await page.context().close();
  page = await open(browser, server, { address });
  assert.deepEqual(await designOf(page), design);
  await assertShows(design);
  await page.waitForFunction(() => document.querySelector('#comparing').textContent.includes('case 5.1'));
  // A link pasted into an open page works, and a broken one does no harm.
  assert.equal(await page.textContent('#design-name'), 'A design of your own');
  await page.evaluate(() => (location.hash = '#design=broken'));
  await settled(page);
  assert.deepEqual(await designOf(page), design);
});

test('document is saved and loaded as file', async () => {
  page = await open(browser, server);
  await enter(page, RADIUS, 4.25);
  const [download] = await Promise.all([page.waitForEvent('download'), pick(page, '#save')]);
  const saved = JSON.parse(await readFile(await download.path(), 'utf8'));
  assert.equal(saved.drive.teeth.radius_mm, 4.25);
  const upload = { name: 'mine.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify({ ...saved, load: { output_torque_nm: 140 } })) };
  await page.setInputFiles('#document-file', upload);
  await settled(page);
  assert.ok(!(await page.isVisible('#document')));
  const design = await designOf(page);
  assert.deepEqual(design.load, { output_torque_nm: 140 });
  await assertShows(design);
  await pick(page, '#open-document');
  await page.fill('#document-text', '{ "drive": ');
  await page.click('#document-apply');
  assert.match(await page.textContent('#document-error'), /not JSON/);
  // A document with an unknown field is shown with the reason and a way out.
  await page.fill('#document-text', JSON.stringify({ ...design, colour: 'blue' }));
  await page.click('#document-apply');
  await settled(page);
  assert.match(await page.textContent('#impossible'), /colour/);
  await page.click('#notes button:has-text("Remove it")');
  await settled(page);
  assert.deepEqual(await designOf(page), design);
});

test('switching the shaft keeps the load', async () => {
  page = await open(browser, server);
  const force = await resultOf(page, 'Force, ring');
  await page.selectOption(field('/load'), 'output_torque_nm');
  await settled(page);
  assert.deepEqual((await designOf(page)).load, { output_torque_nm: 280 });
  assert.ok(Math.abs((await resultOf(page, 'Force, ring')) / force - 1) < 1e-12);
  assert.ok(await page.isHidden(field('/model/stiffness/ring_n_per_mm')));
  await page.selectOption(field('/model/stiffness'), 'fixed');
  await page.selectOption(field('/model/compatibility'), 'virtual_work');
  await enter(page, '/model/stiffness/ring_n_per_mm', 250000);
  const design = await designOf(page);
  assert.deepEqual(design.model, {
    compatibility: 'virtual_work',
    stiffness: { law: 'fixed', wave_generator_n_per_mm: 500000, ring_n_per_mm: 250000, carrier_n_per_mm: 500000 },
  });
  await assertShows(design);
});

const setDocument = (design) => putDocument(page, design);

/** The columns of a sweep's states by instant: `[{ angle, teeth: Map(tooth → index) }]`. */
function instants({ states }) {
  const found = [];
  states.tooth.forEach((tooth, index) => {
    const angle = states.input_angle_deg[index];
    const last = found.at(-1);
    if (last?.angle !== angle || last.teeth.has(tooth) || tooth < Math.max(...last.teeth.keys())) found.push({ angle, teeth: new Map() });
    found.at(-1).teeth.set(tooth, index);
  });
  return found;
}

const range = (values) => [Math.min(...values), Math.max(...values)];

test('form asks for further options, table answers them', async () => {
  page = await open(browser, server);
  assert.equal(await resultOf(page, 'Least wind-up'), undefined);
  await page.selectOption(field('/model/stiffness'), 'palmgren');
  await page.selectOption(field('/model/compatibility'), 'virtual_work');
  await enter(page, '/parts/ring/clearance_um', 4);
  await enter(page, '/parts/carrier/clearance_um', 1.5);
  // A result that was not requested links to its option.
  await page.click('#table button[aria-label^="Torque capacity"]');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'field-load-allowable_stress_mpa');
  await enter(page, '/load/allowable_stress_mpa', 1500);
  await page.click('#table button[aria-label^="Wind-up"]');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'field-sweep-wind_up');
  await page.keyboard.press('Space');
  await page.selectOption(field('/sweep'), 'tolerance');
  await enter(page, '/sweep/tolerance', 1e-7);
  const design = await designOf(page);
  const example = await server.example('paper-5.1');
  assert.deepEqual(design, {
    ...example,
    load: { input_torque_nm: 20, allowable_stress_mpa: 1500 },
    model: { compatibility: 'virtual_work', stiffness: { law: 'palmgren' } },
    parts: { ring: { clearance_um: 4 }, carrier: { clearance_um: 1.5 } },
    sweep: { wind_up: true, tolerance: 1e-7 },
  });
  await assertShows(design);
  const { sweep } = await server.answers(design);
  const { wind_up: windUp, torque_capacity: capacity, states } = sweep;
  const carrying = instants(sweep).map(({ teeth }) => [...teeth.values()].filter((index) => states.loaded[index]).length);
  const [leastWindUp, mostWindUp] = range(windUp.wind_up_deg);
  const [softest, stiffest] = range(windUp.torsional_stiffness_nm_per_rad);
  const [fewest, most] = range(carrying);
  assert.deepEqual([fewest, most], range(windUp.loaded_teeth));
  for (const [label, value] of Object.entries({
    'Least wind-up': leastWindUp,
    'Largest wind-up': mostWindUp,
    'Least torsional stiffness': softest,
    'Largest torsional stiffness': stiffest,
    'Transmission error': windUp.transmission_error_peak_to_peak_deg,
    'Fewest loaded teeth': fewest,
    'Most loaded teeth': most,
    'Input torque': capacity.input_torque_nm,
    'Output torque': capacity.output_torque_nm,
    'At the input angle': capacity.input_angle_deg,
  })) {
    assert.equal(await resultOf(page, label), value, label);
  }
  const limit = page.locator('#table tr', { hasText: 'Limited by' });
  assert.match(await limit.textContent(), new RegExp(capacity.limited_by.replace('_', ' ')));
  // Each value has its reference and its difference.
  await page.click('#keep');
  await enter(page, '/parts/ring/clearance_um', 8);
  assert.match(await page.locator('#table tr', { hasText: 'Largest wind-up' }).textContent(), /deg.*deg\+.*%/);
  assert.match(await page.locator('#table tr', { hasText: 'Output torque' }).textContent(), /N·m.*N·m[−+].*%/);
  // A value of only one design is a dash for the other one, without a unit.
  await enter(page, '/load/allowable_stress_mpa', '');
  assert.match(await page.locator('#table tr', { hasText: 'Output torque' }).textContent(), /^Output torque MG–\d[\d.]*N·m$/);
  await page.click('#undo');
  await settled(page);
  // Switching the torque's shaft keeps the rest of the load, and empty values leave the document.
  await page.selectOption(field('/load'), 'output_torque_nm');
  await page.selectOption(field('/sweep'), 'samples');
  await page.uncheck(field('/sweep/wind_up'));
  await enter(page, '/parts/ring/clearance_um', '');
  await enter(page, '/parts/carrier/clearance_um', '');
  const back = await designOf(page);
  assert.deepEqual(back.load, { output_torque_nm: 280, allowable_stress_mpa: 1500 });
  assert.deepEqual(back.sweep, { samples: 50 });
  assert.deepEqual(back.model, { compatibility: 'virtual_work', stiffness: { law: 'palmgren' } });
  await assertShows(back);
});

test('findings explain themselves, reasons are at their fields', async () => {
  page = await open(browser, server);
  await enter(page, '/parts/ring/clearance_um', 3);
  await page.click(`${notes('/model/stiffness')} .finding`);
  assert.match(await page.textContent(notes('/model/stiffness')), /Linear law is too stiff.*What is tested.*µm.*limit is.*µm.*johnson/);
  await page.selectOption(field('/model/stiffness'), 'palmgren');
  await page.click('summary:has-text("Materials")');
  await enter(page, '/materials/ring/youngs_modulus_gpa', 100);
  assert.match(await page.textContent(notes('/model/stiffness')), /Palmgren’s law is for steel, ring/);
  await choose(page, 'ring-with-more-teeth');
  await page.selectOption(field('/model/compatibility'), 'projection');
  await enter(page, '/parts/carrier/clearance_um', 2);
  assert.match(await page.textContent(notes('/parts/carrier/clearance_um')), /negatively.*virtual_work/);
  assert.equal(await page.getAttribute(field('/parts/carrier/clearance_um'), 'aria-invalid'), 'true');
  await page.click(`${notes('/parts/carrier/clearance_um')} button:has-text("Set to 0")`);
  await settled(page);
  assert.ok(await page.isHidden('#impossible'));
  // The document may have only one of the two.
  const design = await server.example('paper-5.1');
  await pick(page, '#open-document');
  await page.fill('#document-text', JSON.stringify({ ...design, load: { input_torque_nm: 20, output_torque_nm: 280, allowable_stress_mpa: 900 }, sweep: { samples: 20, tolerance: 1e-4 } }));
  await page.click('#document-apply');
  await settled(page);
  assert.match(await page.textContent(notes('/load')), /input_torque_nm.*output_torque_nm/);
  await page.click(`${notes('/load')} button:has-text("Keep output torque")`);
  await settled(page);
  assert.match(await page.textContent(notes('/sweep')), /samples.*tolerance/);
  await page.click(`${notes('/sweep')} button:has-text("Keep relative tolerance")`);
  await settled(page);
  const kept = await designOf(page);
  assert.deepEqual([kept.load, kept.sweep], [{ output_torque_nm: 280, allowable_stress_mpa: 900 }, { tolerance: 1e-4 }]);
  assert.ok(await page.isHidden('#impossible'));
});

test('teeth that clearance unloads are drawn and labelled', async () => {
  page = await open(browser, server);
  await enter(page, '/parts/ring/clearance_um', 20);
  const design = await designOf(page);
  const { sweep } = await server.answers(design);
  await page.locator('#angle').fill('0');
  await page.click('#teeth-table summary');
  await settled(page);
  const states = [...instants(sweep)[0].teeth].map(([tooth, index]) => ({ tooth, loaded: sweep.states.loaded[index] }));
  const idle = states.filter(({ loaded }) => !loaded).map(({ tooth }) => tooth);
  const busy = states.filter(({ loaded }) => loaded).map(({ tooth }) => tooth);
  assert.ok(idle.length > 0 && busy.length > 0);
  const fill = (tooth) => page.$eval(`#whole [data-tooth="${tooth}"]`, (element) => element.style.fill);
  for (const tooth of idle) assert.equal(await fill(tooth), '', `tooth ${tooth}`);
  for (const tooth of busy) assert.notEqual(await fill(tooth), '', `tooth ${tooth}`);
  const arrows = async (contact) => ((await page.getAttribute(`#whole .arrow.contact-${contact}`, 'd')).match(/M/g) ?? []).length / 2;
  assert.equal(await arrows('ring'), 2 * busy.length);
  const listed = await page.$$eval('#teeth tbody th', (cells) => cells.map((cell) => Number(cell.textContent)));
  assert.deepEqual(listed, [...busy, ...busy.map((tooth) => tooth + 14)].sort((one, other) => one - other));
  for (let presses = 0; presses < 28 && !idle.includes(Number((await page.textContent('#tooth-name')).slice(6))); presses += 1) {
    await page.click('#tooth-after');
    await settled(page);
  }
  assert.match(await page.textContent('#tooth-state'), /no load/);
});

test('double angle is a jump in mechanism and plots', async () => {
  page = await open(browser, server);
  const found = await page.evaluate(async () => {
    const { Motion } = await import('/page/motion.js');
    const { passOf, readAt } = await import('/page/pass.js');
    const design = { ...(await (await fetch('/v1/examples/paper-5.2')).json()), sweep: { tolerance: 1e-6 } };
    const ask = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).json();
    const [geometry, sweep] = [await ask('/v1/geometry'), await ask('/v1/sweep')];
    const motion = new Motion(design, geometry, sweep);
    const pass = passOf(design, sweep);
    const at = motion.frames.findIndex(({ angle }, index) => angle === motion.frames[index + 1]?.angle);
    const [without, within] = [motion.frames[at], motion.frames[at + 1]].map(({ rows }) => [...rows.values()].map(({ tooth, force_ring_n: force }) => [tooth, force]));
    const near = (deg) => motion.loaded(deg).filter(({ zone }) => zone === 0).map(({ tooth, force }) => [tooth, force.ring]);
    const { angle } = motion.frames[at];
    const xs = pass.x.ring;
    return {
      without,
      within,
      before: near(angle - 1e-9),
      after: near(angle + 1e-9),
      jumps: pass.breaks.size,
      ascends: xs.every((x, index) => index === 0 || x >= xs[index - 1]),
      breaks: [...pass.breaks].map((index) => [pass.force.ring[index - 1], pass.force.ring[index]]),
      peak: [sweep.peaks.ring.force_n.value, Math.max(...pass.force.ring)],
      sides: [...pass.breaks].map((index) => readAt(pass, 'input', pass.x.input[index - 1] - 1e-7).force.ring),
    };
  });
  const assertNear = (got, wanted, what) => {
    assert.deepEqual(got.map(([tooth]) => tooth), wanted.map(([tooth]) => tooth), what);
    got.forEach(([, force], index) => assert.ok(Math.abs(force - wanted[index][1]) < 1e-5 * wanted[index][1], what));
  };
  assert.equal(found.within.length, found.without.length + 1);
  assertNear(found.before, found.without, 'just before');
  assertNear(found.after, found.within, 'just after');
  assert.equal(found.jumps, found.without.length);
  assert.ok(found.ascends);
  for (const [before, after] of found.breaks) assert.ok(after < 0.9 * before, 'the others are relieved when a tooth enters');
  found.sides.forEach((force, index) => assert.ok(Math.abs(force / found.breaks[index][0] - 1) < 1e-5));
  assert.equal(found.peak[0], found.peak[1]);
});

async function measure() {
  await page.click('#measure');
  await page.waitForFunction(() => /Fastest within|No choice/.test(document.querySelector('#accuracy-state').textContent));
}

test('accuracy equals the API’s, and a row applies its choice', async () => {
  page = await open(browser, server);
  assert.equal(await page.textContent('#accuracy-list'), '');
  await measure();
  const original = await designOf(page);
  const answer = await server.ask('/v1/accuracy', original);
  const shown = await page.$$eval('#accuracy-list details', (models) =>
    models.flatMap((model) =>
      [...model.querySelectorAll('tbody tr')].map((row) => {
        const [error, time, states] = [...row.querySelectorAll('data')].map(({ value }) => Number(value));
        return { name: row.querySelector('button').getAttribute('aria-label'), error, time, states, note: model.querySelector('summary').textContent };
      }),
    ),
  );
  assert.deepEqual(shown.map(({ error, states }) => [error, states]), answer.ways.map(({ error, states }) => [error, states]));
  assert.ok(shown.every(({ time }) => time > 0));
  assert.match(shown[0].note, /^Projection, Linear this design’s own$/);
  const palmgren = answer.ways.findIndex(({ compatibility, law }) => compatibility === 'virtual_work' && law === 'palmgren');
  assert.match(shown[palmgren].note, new RegExp(`^Virtual work, Palmgren peaks differ by ${(100 * answer.ways[palmgren].model_difference).toFixed(2)}`));
  assert.equal(await page.getAttribute('#accuracy-list button:has-text("50 samples")', 'aria-pressed'), 'true');
  // The number of samples does not change the question, but the model does.
  await page.click('#accuracy-list button[aria-label="200 samples: use with Projection, Linear"]');
  await settled(page);
  assert.deepEqual(await designOf(page), { ...original, sweep: { samples: 200 } });
  assert.match(await page.textContent('#accuracy-state'), /^Fastest within/);
  await page.click('#accuracy-list summary:has-text("Virtual work, Palmgren")');
  await page.focus('#accuracy-list button[aria-label^="to 1·10⁻⁸"][aria-label$="Virtual work, Palmgren"]');
  await page.keyboard.press('Enter');
  await settled(page);
  const design = await designOf(page);
  assert.deepEqual(design, { ...original, model: { compatibility: 'virtual_work', stiffness: { law: 'palmgren' } }, sweep: { tolerance: 1e-8 } });
  await assertShows(design);
  assert.match(await page.textContent('#accuracy-state'), /another design; measure again/);
  await page.click('#undo');
  await settled(page);
  assert.deepEqual(await designOf(page), { ...original, sweep: { samples: 200 } });
  // The requested error is part of the design and starts a new request.
  await page.selectOption('#accuracy-wanted', '0.01');
  await page.waitForFunction(() => document.querySelector('#accuracy-state').textContent.startsWith('Fastest within 0.01'));
  assert.equal((await designOf(page)).accuracy.requested_error, 0.01);
  assert.equal(await page.locator('#accuracy-list .cheapest').count(), 1);
  // An impossible design has no accuracy but reasons.
  await enter(page, SEMI_MINOR, 60);
  await page.click('#measure');
  await page.waitForFunction(() => document.querySelector('#accuracy-state').textContent.includes('must exceed'));
});

test('accuracy rows of fixed law restore measured stiffnesses', async () => {
  page = await open(browser, server);
  await page.selectOption(field('/model/stiffness'), 'fixed');
  await enter(page, '/model/stiffness/ring_n_per_mm', 250000);
  const original = await designOf(page);
  await measure();
  const own = page.locator('#accuracy-list details', { hasText: /^Projection, Fixed stiffnesses/ });
  assert.equal(await own.locator('summary').textContent(), 'Projection, Fixed stiffnesses this design’s own');
  const errors = await own.locator('tbody td:nth-child(2) data').evaluateAll((cells) => cells.map(({ value }) => Number(value)));
  const { ways } = await server.ask('/v1/accuracy', original);
  assert.deepEqual(errors, ways.filter(({ compatibility, law }) => compatibility === 'projection' && law === 'fixed').map(({ error }) => error));
  const use = async (way) => {
    await page.$eval(`#accuracy-list button[aria-label="${way}"]`, (button) => button.click());
    await settled(page);
    return designOf(page);
  };
  assert.deepEqual((await use('50 samples: use with Virtual work, Palmgren')).model, { compatibility: 'virtual_work', stiffness: { law: 'palmgren' } });
  assert.deepEqual((await use('50 samples: use with Virtual work, Fixed stiffnesses')).model, { ...original.model, compatibility: 'virtual_work' });
  // Other stiffnesses are another question, for which the rows do not hold.
  await enter(page, '/model/stiffness/ring_n_per_mm', 400000);
  assert.match(await page.textContent('#accuracy-state'), /another design; measure again/);
  const back = await use('100 samples: use with Projection, Fixed stiffnesses');
  assert.deepEqual(back, { ...original, model: { ...original.model, compatibility: 'projection' }, sweep: { samples: 100 } });
  await assertShows(back);
});

/** Presses a file's button and gives the file: `{ name, bytes }`. The browser was seen to tell of none, for no reason that was found;
 *  where the page neither waits nor tells of a problem the button is pressed once more, and the output says so. */
async function downloaded(file, press = () => pick(page, `[data-file="${file}"]`), isAgain = false) {
  try {
    const [download] = await Promise.all([page.waitForEvent('download', { timeout: 60_000 }), press()]);
    return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
  } catch (error) {
    const words = await page.textContent('#drawings-state');
    const isIdle = /^(Downloaded .*)?$/.test(words);
    if (isAgain || !isIdle) throw new Error(`${file}: no download; the page says: ${words || 'nothing'}`, { cause: error });
    console.log(`${file}: no download, and the page says: ${words || 'nothing'}. Pressed again.`);
    return downloaded(file, press, true);
  }
}

/** Parts that differ from their defaults in every value. */
const PARTS = {
  wave_generator: { bore_radius_mm: 20, clearance_um: 3 },
  teeth: { clearance_um: 5 },
  ring: { outer_radius_mm: 90, clearance_um: 10 },
  carrier: { inner_radius_mm: 59.5, outer_radius_mm: 65, clearance_um: 15 },
};

const MEDIA_TYPES = { dxf: 'image/vnd.dxf', step: 'model/step', svg: 'image/svg+xml' };
const DRAWN = ['ring', 'wave-generator', 'carrier', 'tooth'];
const BORE = '/parts/wave_generator/bore_radius_mm';

for (const [what, parts] of Object.entries({ default: undefined, given: PARTS })) {
  test(`drawings of ${what} parts equal the API’s and are named`, async () => {
    page = await open(browser, server);
    const design = { ...(await server.example('paper-5.1')), parts };
    await setDocument(design);
    for (const part of DRAWN) {
      for (const [format, mediaType] of Object.entries(MEDIA_TYPES)) {
        const { name, bytes } = await downloaded(`${part}.${format}`);
        assert.match(name, new RegExp(`^the-papers-case-5\\.1${parts ? '-changed-[0-9a-f]{6}' : ''}-${part}\\.${format}$`));
        assert.ok(bytes.equals(await server.file(`/v1/drawings/${part}`, design, mediaType)), name);
        assert.equal(await page.textContent('#drawings-state'), `Downloaded ${name}.`);
      }
    }
  });
}

test('plot files equal the API’s answers', async () => {
  page = await open(browser, server);
  await enter(page, RADIUS, 4.5);
  const { name, bytes } = await downloaded('plots.svg');
  assert.match(name, /^the-papers-case-5\.1-changed-[0-9a-f]{6}-plots\.svg$/);
  assert.ok(bytes.equals(await server.file('/v1/sweep', await designOf(page), MEDIA_TYPES.svg)));
});

test('page requests no drawing by itself', async () => {
  page = await open(browser, server);
  let drawings = 0;
  page.on('request', (request) => (drawings += request.url().includes('/v1/drawings/') ? 1 : 0));
  await pick(page, '#to-parts');
  await enter(page, BORE, 20);
  await page.locator(`.field:has(${field(RADIUS)}) input[type=range]`).press('ArrowRight');
  await settled(page);
  assert.equal(drawings, 0);
  await downloaded('ring.svg');
  assert.equal(drawings, 1);
  await page.locator(`.field:has(${field(RADIUS)}) input[type=range]`).press('ArrowRight');
  await settled(page);
  assert.equal(drawings, 1);
  assert.equal(await page.textContent('#drawings-state'), '', 'what was said was about another design');
});

test('assembly file has the input angle on display', async () => {
  page = await open(browser, server);
  const design = { ...(await server.example('paper-5.1')), assembly: { input_angle_deg: 30 } };
  await setDocument(design);
  const at = (angle) => ({ ...design, assembly: { input_angle_deg: angle } });
  const sent = async (file) => {
    const [request, { bytes }] = await Promise.all([page.waitForRequest('**/v1/drawings/assembly'), downloaded(file)]);
    return { document: request.postDataJSON(), bytes };
  };
  for (const [format, mediaType] of Object.entries(MEDIA_TYPES)) {
    await page.locator('#angle').fill('43.7');
    await settled(page);
    const { document, bytes } = await sent(`assembly.${format}`);
    assert.deepEqual(document, at(43.7));
    assert.ok(bytes.equals(await server.file('/v1/drawings/assembly', at(43.7), mediaType)), format);
    assert.ok(!bytes.equals(await server.file('/v1/drawings/assembly', design, mediaType)), `${format}: not as the document has it`);
    assert.match(await page.textContent('#drawings-state'), /-assembly\.(dxf|step|svg), input angle 43\.7°\.$/);
  }
  assert.match(await page.textContent('#drawings-list'), /Assembly at 43\.7°/);
  assert.deepEqual(await designOf(page), design, 'the document keeps its own angle');
  // The position of a peak is exact, not rounded for display.
  await page.locator('#table tr', { hasText: 'Contact stress, ring' }).locator('button').click();
  await settled(page);
  const { sweep } = await server.answers(design);
  assert.deepEqual((await sent('assembly.svg')).document, at(sweep.peaks.ring.stress_mpa.input_angle_deg));
  // After a turn the carrier has another position.
  await page.locator('#angle').fill('350');
  await page.locator('#whole').scrollIntoViewIfNeeded();
  const box = await page.locator('#whole').boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x + 100, y);
  await page.mouse.down();
  await page.mouse.move(x + 94, y - 34);
  await page.mouse.up();
  await settled(page);
  const { document: turned } = await sent('assembly.dxf');
  assert.ok(Math.abs(turned.assembly.input_angle_deg - 370) < 1, `${turned.assembly.input_angle_deg}`);
  await page.click('#play');
  const { document: moving, bytes } = await sent('assembly.dxf');
  assert.ok(moving.assembly.input_angle_deg >= turned.assembly.input_angle_deg);
  assert.ok(bytes.equals(await server.file('/v1/drawings/assembly', moving, MEDIA_TYPES.dxf)));
  assert.equal(await page.textContent('#play'), 'Pause', 'and it moves on');
});

test('refused drawing shows reasons and downloads nothing', async () => {
  page = await open(browser, server);
  const downloads = [];
  page.on('download', (download) => downloads.push(download.suggestedFilename()));
  const refused = () => page.waitForSelector('#drawings-state .problem');
  const group = 'details:has(> summary:has-text("Parts as they are made"))';
  const impossible = { wave_generator: { bore_radius_mm: 57 }, carrier: { outer_radius_mm: 70 } };
  await setDocument({ ...(await server.example('paper-5.1')), parts: impossible });
  // The drive itself is still possible.
  assert.ok(await page.isHidden('#impossible'));
  assert.equal(await page.getAttribute(group, 'open'), null);
  await assertShows(await designOf(page));
  await pick(page, '[data-file="assembly.dxf"]');
  await refused();
  const { errors } = await server.ask('/v1/drawings/assembly', await designOf(page));
  assert.ok(errors.length > 0);
  for (const { pointer } of errors) {
    assert.ok((await page.textContent(notes(pointer))).length > 20, pointer);
    assert.equal(await page.getAttribute(field(pointer), 'aria-invalid'), 'true', pointer);
  }
  assert.match(await page.textContent('#drawings-state'), /^Assembly: .*Nothing was downloaded/);
  assert.notEqual(await page.getAttribute(group, 'open'), null, 'the group is unfolded');
  assert.ok(await page.isHidden('#impossible'), 'the drive is possible');
  // Each part has its own reasons, and each reason links to its field.
  await pick(page, '[data-file="wave-generator.svg"]');
  await refused();
  assert.match(await page.textContent(notes(BORE)), /A bore of 57(\.0)? mm cuts the wave generator open/);
  assert.equal(await page.textContent(notes('/parts/carrier/outer_radius_mm')), '');
  await page.click('#drawings-state button:has-text("Bore radius, wave generator")');
  assert.equal(await page.evaluate(() => document.activeElement.id), field(BORE).slice(1));
  await page.keyboard.press('Control+a');
  await page.keyboard.type('20');
  await settled(page);
  assert.equal(await page.textContent(notes(BORE)), '');
  assert.deepEqual(downloads, []);
  const { name } = await downloaded('wave-generator.svg');
  assert.match(name, /^the-papers-case-5\.1-changed-[0-9a-f]{6}-wave-generator\.svg$/);
  // An impossible drive has no drawings, and each reason appears once at its field.
  await enter(page, SEMI_MINOR, 60);
  await pick(page, '[data-file="tooth.dxf"]');
  await refused();
  assert.equal(await page.locator(`${notes(SEMI_MAJOR)} .problem`).count(), 1);
  assert.deepEqual(downloads, [name]);
});

test('undo, link and document keep the parts', async () => {
  page = await open(browser, server);
  const example = await server.example('paper-5.1');
  await pick(page, '#to-parts');
  assert.equal(await page.evaluate(() => document.activeElement.id), field(BORE).slice(1));
  const entries = Object.entries(PARTS).flatMap(([part, values]) => Object.entries(values).map(([key, value]) => [`/parts/${part}/${key}`, value]));
  for (const [pointer, value] of entries) {
    assert.ok(await page.getAttribute(field(pointer), 'placeholder'), `${pointer} says what is taken without it`);
    await enter(page, pointer, value);
    await page.locator(field(pointer)).blur();
  }
  assert.deepEqual(await designOf(page), { ...example, parts: PARTS });
  assert.match(await page.textContent('summary:has-text("Parts as they are made")'), /4 given/);
  await pick(page, '#copy-link');
  const address = await page.evaluate(() => location.hash);
  await page.click('#undo');
  assert.deepEqual((await designOf(page)).parts, { ...PARTS, carrier: { inner_radius_mm: 59.5, outer_radius_mm: 65 } });
  for (let presses = 1; presses < entries.length; presses += 1) await page.click('#undo');
  await settled(page);
  assert.deepEqual(await designOf(page), example);
  assert.ok(await page.isDisabled('#undo'));
  await page.click('#redo');
  assert.deepEqual((await designOf(page)).parts, { wave_generator: { bore_radius_mm: 20 } });
  // An emptied value leaves the document, and so does an emptied group.
  await enter(page, BORE, '');
  assert.deepEqual(await designOf(page), example);
  await page.context().close();
  page = await open(browser, server, { address });
  assert.deepEqual(await designOf(page), { ...example, parts: PARTS });
});

test('failed drawing request is reported', async () => {
  page = await open(browser, server);
  page.expectsOutage = true;
  await page.route('**/v1/drawings/**', (route) => route.abort());
  await pick(page, '[data-file="ring.dxf"]');
  await page.waitForFunction(() => document.querySelector('#drawings-state').textContent === 'The calculation service does not answer.');
});

test('drawing places teeth as the service does', async () => {
  page = await open(browser, server);
  for (const name of ['paper-5.1', 'paper-5.2', 'ring-with-more-teeth']) {
    await choose(page, name);
    const design = await server.example(name);
    const { sweep } = await server.answers(design);
    const installed = design.drive.teeth.installed ?? design.drive.teeth.count;
    await page.locator('#angle').fill('0');
    if (await page.isHidden('#teeth')) await page.click('#teeth-table summary');
    await settled(page);
    const table = await page.$$eval('#teeth tbody tr', (rows) => rows.map((row) => [...row.children].map((cell) => Number(cell.textContent))));
    const { states } = sweep;
    const count = states.input_angle_deg.filter((angle) => angle === 0).length;
    assert.equal(table.length, 2 * count, `${name}: both zones`);
    for (let index = 0; index < count; index += 1) {
      for (const turn of [0, installed / 2]) {
        const tooth = (states.tooth[index] + turn) % installed;
        const row = table.find(([number]) => number === tooth);
        const columns = ['position_deg', 'force_wave_generator_n', 'force_ring_n', 'force_carrier_n', 'stress_wave_generator_mpa', 'stress_ring_mpa', 'stress_carrier_mpa'];
        columns.forEach((column, place) => assert.ok(Math.abs(row[place + 1] - states[column][index]) <= 0.0501, `${name} ${tooth} ${column}`));
        const circle = await page.$eval(`#whole [data-tooth="${tooth}"]`, (element) => ['cx', 'cy'].map((axis) => Number(element.getAttribute(axis))));
        const angle = ((states.position_deg[index] + (turn ? 180 : 0)) * Math.PI) / 180;
        const radius = states.center_radius_mm[index];
        assert.ok(Math.hypot(circle[0] - radius * Math.cos(angle), circle[1] - radius * Math.sin(angle)) < 0.002, `${name}: centre of tooth ${tooth}`);
      }
    }
  }
});

test('drawn forces balance and repeat after a period', async () => {
  page = await open(browser, server);
  await choose(page, 'paper-5.2');
  const result = await page.evaluate(async () => {
    const { Motion } = await import('/page/motion.js');
    const design = await (await fetch('/v1/examples/paper-5.2')).json();
    const ask = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).json();
    const [geometry, sweep] = [await ask('/v1/geometry'), await ask('/v1/sweep')];
    const motion = new Motion(design, geometry, sweep);
    let residual = 0;
    let reach = 0;
    for (const { angle } of motion.frames) {
      for (const { center, contacts, force } of motion.loaded(angle)) {
        const sum = { x: 0, y: 0 };
        for (const [key, contact] of Object.entries(contacts)) {
          const distance = Math.hypot(center.x - contact.x, center.y - contact.y);
          reach = Math.max(reach, Math.abs(distance - design.drive.teeth.radius_mm));
          sum.x += (force[key] * (center.x - contact.x)) / distance;
          sum.y += (force[key] * (center.y - contact.y)) / distance;
        }
        residual = Math.max(residual, Math.hypot(sum.x, sum.y) / force.ring);
      }
    }
    const now = motion.loaded(3).map(({ tooth, force }) => [tooth, force.ring]);
    const later = motion.loaded(3 + motion.pattern.deg).map(({ tooth, force }) => [(tooth + 39) % 40, force.ring]);
    const byTooth = (one, other) => one[0] - other[0];
    return { residual, reach, now: now.sort(byTooth), later: later.sort(byTooth) };
  });
  assert.ok(result.reach < 1e-6, `contacts off the tooth by ${result.reach} mm`);
  assert.ok(result.residual < 2e-3, `forces out of balance by ${result.residual}`);
  result.now.forEach(([tooth, force], index) => {
    assert.equal(result.later[index][0], tooth);
    assert.ok(Math.abs(result.later[index][1] - force) < 1e-6 * force);
  });
});

test('plots break only where a tooth enters under load', async () => {
  page = await open(browser, server);
  const breaks = (name) =>
    page.evaluate(async (example) => {
      const { passOf } = await import('/page/pass.js');
      const design = await (await fetch(`/v1/examples/${example}`)).json();
      const ask = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).json();
      const pass = passOf(design, await ask('/v1/sweep'));
      const xs = pass.x.ring;
      return { jumps: pass.breaks.size, sorted: xs.every((x, index) => index === 0 || x >= xs[index - 1]) };
    }, name);
  assert.deepEqual(await breaks('paper-5.1'), { jumps: 0, sorted: true });
  assert.deepEqual(await breaks('paper-5.2'), { jumps: 4, sorted: true });
});

test('many teeth are thinned but the selected one stays', async () => {
  page = await open(browser, server);
  const teeth = { radius_mm: 1.2, width_mm: 15, count: 10000 };
  await setDocument({ drive: { wave_generator: { semi_major_mm: 5000.7, semi_minor_mm: 4999.3 }, teeth, ring: { teeth: 9998 } }, load: { input_torque_nm: 3 } });
  const drawn = await page.$$eval('#whole .tooth', (circles) => circles.map((circle) => Number(circle.dataset.tooth)));
  assert.ok(drawn.length > 1000 && drawn.length <= 1440, `${drawn.length} teeth`);
  const tooth = [...Array(10).keys()].slice(4).find((candidate) => !drawn.includes(candidate));
  for (let presses = 3; presses < tooth; presses += 1) await page.click('#tooth-after');
  await settled(page);
  assert.equal(await page.textContent('#tooth-name'), `Tooth ${tooth}`);
  for (const view of ['#whole', '#detail']) assert.equal(await page.getAttribute(`${view} .tooth.selected`, 'data-tooth'), String(tooth));
});

test('plots, peaks and mechanism are linked', async () => {
  page = await open(browser, server);
  for (const abscissa of ['input', 'ring', 'cam', 'slot']) {
    await page.check(`#abscissae input[value=${abscissa}]`, { force: true });
    const over = page.locator('#charts .chart').first();
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    await page.mouse.move(box.x + box.width * 0.4, box.y + box.height / 2);
    assert.match(await page.textContent('#readout caption'), /At the cursor/);
    await page.mouse.down();
    await page.mouse.up();
    await page.mouse.move(2, 2);
    await settled(page);
    assert.match(await page.textContent('#readout caption'), /^Tooth 3: /, abscissa);
    assert.match(await page.textContent('#tooth-state'), /MPa/, 'the selected tooth was turned to the place that was clicked');
  }
  const row = page.locator('#table tr', { hasText: 'Contact stress, ring' });
  await row.locator('button').click();
  await settled(page);
  assert.match(await page.textContent('#tooth-state'), /ψ 70\.2°, σ up to 980 MPa/);
});

test('loaded teeth stay marked in plots after resize', async () => {
  page = await open(browser, server);
  await page.setViewportSize({ width: 1300, height: 900 });
  await page.waitForFunction(() => document.querySelector('#charts .chart').clientWidth === document.querySelector('#charts .chart svg').clientWidth);
  await settled(page);
  const marks = await page.$$eval('#charts figure:not([hidden])', (figures) => figures.map((figure) => figure.querySelectorAll('.plot-mark').length));
  assert.ok(marks.length === 2 && marks.every((count) => count > 3), `${marks}`);
});

test('reference shows differences everywhere', async () => {
  page = await open(browser, server);
  await page.click('#keep');
  await choose(page, 'paper-5.2');
  const row = page.locator('#table tr', { hasText: 'Force, ring' });
  assert.match(await row.textContent(), /739\.47N1549\.3N−810 \(−52\.3.%\)/);
  assert.match(await page.textContent('#key-figures'), /40\+26/);
  assert.ok((await page.getAttribute('#whole .ghost', 'd')).length > 1000);
  assert.match(await page.textContent('#readout'), /−\d/);
  await page.click('#swap');
  await settled(page);
  assert.match(await row.textContent(), /1549\.3N739\.47N\+810/);
  await page.click('#clear');
  await settled(page);
  assert.ok(await page.isHidden('#comparing'));
  assert.equal(await page.getAttribute('#whole .ghost', 'd'), '');
});

test('play, pause and drag show both angles', async () => {
  page = await open(browser, server);
  const angle = async () => Number.parseFloat(await page.textContent('#angle-input'));
  assert.equal(await angle(), 0, 'at rest where reduced motion is wanted');
  const turned = () => page.waitForFunction(() => Number.parseFloat(document.querySelector('#angle-input').textContent) > 1);
  await page.click('#play');
  await turned();
  await page.click('#play');
  await settled(page);
  const atRest = await angle();
  await settled(page);
  assert.equal(await angle(), atRest, 'paused');
  await page.locator('#angle').fill('140');
  await settled(page);
  assert.equal(await page.textContent('#angle-carrier'), '10.00°');
  const box = await page.locator('#whole').boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x + 100, y);
  await page.mouse.down();
  await page.mouse.move(x + 90, y - 52);
  await page.mouse.move(x, y - 100);
  await page.mouse.up();
  await settled(page);
  assert.ok(Math.abs((await angle()) - 230) < 1);
  await page.mouse.click(x + 0.72 * (box.width / 2), y);
  await settled(page);
  assert.notEqual(await page.textContent('#tooth-name'), 'Tooth 3');
  await page.context().close();
  page = await open(browser, server, { reducedMotion: 'no-preference' });
  // The animation starts if the user has not asked for reduced motion.
  await turned();
});

test('keyboard operates the whole page', async () => {
  page = await open(browser, server);
  const tabTo = async (id) => {
    for (let presses = 0; presses < 160; presses += 1) {
      await page.keyboard.press('Tab');
      const found = await page.evaluate((wanted) => document.activeElement.matches(wanted), id);
      if (found) {
        const outline = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
        assert.notEqual(outline, 'none', `${id} shows its focus`);
        return;
      }
    }
    assert.fail(`${id} is not reached`);
  };
  await page.keyboard.press('Tab');
  assert.equal(await page.evaluate(() => document.activeElement.className), 'skip');
  // The keyboard opens a menu, which closes after a choice.
  await tabTo('[popovertarget=examples], [popovertarget=examples] ~ *');
  for (let moves = 0; moves < 8 && !(await page.evaluate(() => document.activeElement.matches('[popovertarget=examples]'))); moves += 1) await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Enter');
  await tabTo('[data-example="paper-5.2"]');
  await page.keyboard.press('Enter');
  await settled(page);
  assert.ok(await page.isHidden('#examples'));
  await tabTo(field(RADIUS));
  await page.keyboard.press('ArrowDown');
  await settled(page);
  assert.ok((await designOf(page)).drive.teeth.radius_mm < 1.5);
  await page.focus(field(RADIUS));
  await tabTo('input[type=range]');
  await page.keyboard.press('ArrowRight');
  await tabTo('.finding');
  await page.keyboard.press('Enter');
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute('aria-expanded')), 'true');
  await tabTo('#play');
  await tabTo('#angle');
  await page.keyboard.press('PageUp');
  await settled(page);
  assert.notEqual(await page.textContent('#angle-input'), '0.0°');
  await tabTo('#tooth-after');
  await page.keyboard.press('Space');
  await settled(page);
  assert.equal(await page.textContent('#tooth-name'), 'Tooth 4');
  await tabTo('#abscissae input');
  await page.keyboard.press('ArrowRight');
  assert.ok(await page.isChecked('#abscissae input[value=ring]'));
  await page.focus('[popovertarget=downloads]');
  await page.keyboard.press('Enter');
  await tabTo('#to-parts');
  await tabTo('[data-file="carrier.dxf"]');
  assert.match((await downloaded('carrier.dxf', () => page.keyboard.press('Enter'))).name, /-carrier\.dxf$/);
  await page.focus('[popovertarget=menu]');
  await page.keyboard.press('Enter');
  await tabTo('#open-document');
  await page.keyboard.press('Enter');
  assert.ok(await page.isVisible('#document'));
  await page.keyboard.press('Escape');
  assert.ok(!(await page.isVisible('#document')));
  assert.ok(await page.evaluate(() => document.activeElement.matches('[popovertarget=menu], #open-document')));
});

test('results and findings are announced', async () => {
  page = await open(browser, server);
  await enter(page, RADIUS, 6.8);
  await page.waitForFunction(() => document.querySelector('#announcer').textContent.includes('Undercut ring tips'));
  await enter(page, RADIUS, 60);
  await page.waitForFunction(() => document.querySelector('#announcer').textContent.startsWith('The design is impossible'));
});

test('page recovers when the service returns', async () => {
  page = await open(browser, server);
  page.expectsOutage = true;
  const { port } = server;
  await server.stop();
  await page.fill(field(RADIUS), '4.75');
  await page.waitForSelector('#away:not([hidden])');
  assert.match(await page.textContent('#away'), /does not answer.*design is kept/);
  assert.ok((await page.getAttribute('#whole .part-ring', 'd')).length > 1000, 'the last picture stays');
  server = await Server.start(port);
  await page.waitForSelector('#away', { state: 'hidden', timeout: 8000 });
  await settled(page);
  const design = await designOf(page);
  assert.equal(design.drive.teeth.radius_mm, 4.75);
  await assertShows(design);
  // An idle page notices it too.
  await server.stop();
  await page.waitForSelector('#away:not([hidden])', { timeout: 9000 });
  server = await Server.start(port);
  await page.waitForSelector('#away', { state: 'hidden', timeout: 8000 });
});

for (const [name, options] of Object.entries({
  light: {},
  narrow: { viewport: { width: 390, height: 844 } },
  tablet: { viewport: { width: 820, height: 1180 }, colorScheme: 'dark' },
})) {
  test(`axe finds nothing: ${name}`, async () => {
    page = await open(browser, server, { bypassCSP: false, ...options });
    await page.click('#keep');
    await choose(page, 'paper-5.2');
    await measure();
    await enter(page, '/load/allowable_stress_mpa', 1500);
    await enter(page, '/parts/ring/clearance_um', 2);
    for (const details of await page.$$('main details:not([open]) > summary')) if (await details.isVisible()) await details.click();
    await page.check(field('/sweep/wind_up'));
    await enter(page, BORE, 100);
    await pick(page, '[data-file="assembly.svg"]');
    await page.waitForSelector('#drawings-state .problem');
    await page.locator(`${notes(RADIUS)} .finding`).first().click();
    await settled(page);
    assert.deepEqual(await violations(), [], 'a design with findings, compared');
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    assert.ok(overflow <= 0, `nothing is wider than the screen (${overflow} px)`);
    await enter(page, SEMI_MINOR, 60);
    assert.deepEqual(await violations(), [], 'an impossible design');
    await pick(page, '#open-document');
    assert.deepEqual(await violations('#document'), [], 'the document');
  });
}

test('theme is chosen and remembered', async () => {
  page = await open(browser, server);
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await background();
  await pick(page, '#theme');
  await pick(page, '#theme');
  assert.equal(await page.textContent('#theme'), 'Theme: dark');
  const dark = await background();
  assert.notEqual(dark, light);
  await page.reload();
  await settled(page);
  assert.equal(await background(), dark);
});

/** Findings about parts as drawn come with the drawings, not with the sweep that the page reports. */
const OF_DRAWINGS = ['groove_not_drawn', 'tooth_leaves_slot', 'thin_wall_as_made', 'clearance_undercuts_ring'];

/** Designs with much to report, which together have every finding of a sweep. */
const NO_STEEL = { wave_generator: { youngs_modulus_gpa: 70 }, ring: { youngs_modulus_gpa: 120 }, carrier: { youngs_modulus_gpa: 110 } };
const LONG_REPORTS = [
  {
    drive: { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { radius_mm: 7, width_mm: 5, count: 28, installed: 28 }, ring: { teeth: 26, tip_radius_mm: 60 } },
    load: { input_torque_nm: 60, allowable_stress_mpa: 1500 },
    model: { compatibility: 'virtual_work', stiffness: { law: 'linear' } },
    materials: { ring: { youngs_modulus_gpa: 120 } },
    sweep: { wind_up: true },
    parts: PARTS,
  },
  {
    drive: { wave_generator: { semi_major_mm: 58, semi_minor_mm: 46 }, teeth: { radius_mm: 4, width_mm: 2, count: 28, installed: 14 }, ring: { teeth: 30, tip_radius_mm: 57.23 } },
    load: { input_torque_nm: 200, allowable_stress_mpa: 1500 },
    model: { compatibility: 'virtual_work', stiffness: { law: 'palmgren' }, refinements: 'none' },
    materials: NO_STEEL,
    sweep: { wind_up: true },
    parts: PARTS,
  },
  {
    drive: { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { radius_mm: 7, width_mm: 5, count: 28, installed: 28 }, ring: { teeth: 26, tip_radius_mm: 70.5 } },
    load: { input_torque_nm: 60, allowable_stress_mpa: 1500 },
    model: { compatibility: 'virtual_work', stiffness: { law: 'palmgren' } },
    materials: NO_STEEL,
    sweep: { wind_up: true },
    parts: PARTS,
  },
];

/** What these do not have: findings of other kinds, laws and loads, each in a report of its own. */
const CASE_5_1 = { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { count: 28, radius_mm: 5, width_mm: 15 }, ring: { teeth: 26 } };
const VIRTUAL_WORK = { compatibility: 'virtual_work', stiffness: { law: 'linear' } };
const rubbing = (coefficient) => ({ wave_generator: { kind: 'plain', coefficient }, ring: { coefficient }, carrier: { coefficient } });
const OTHER_REPORTS = {
  hollow_wave_generator: {
    drive: { wave_generator: { kind: 'harmonic_path', lobes: 3, mean_path_radius_mm: 60, amplitude_mm: 6.5 }, teeth: { count: 9, radius_mm: 7, width_mm: 15 }, ring: { teeth: 6 } },
    load: { input_torque_nm: 20 },
  },
  flat_cuts_the_contact: { drive: { ...CASE_5_1, teeth: { ...CASE_5_1.teeth, shape: 'flat_sided', flat_length_mm: 9.7 } }, load: { input_torque_nm: 20 }, model: VIRTUAL_WORK },
  // In such tight grooves the contacts are nearly as long as the balls are wide.
  contact_beyond_groove: {
    drive: {
      wave_generator: { kind: 'eccentric', radius_mm: 30, eccentricity_mm: 1 },
      teeth: { shape: 'ball', count: 16, radius_mm: 3, groove_radius_mm: { wave_generator: 3.0001, ring: 3.0001, carrier: 3.0001 } },
      ring: { teeth: 17 },
    },
    load: { input_torque_nm: 3 },
  },
  projection_on_steep_flank: {
    drive: { wave_generator: { semi_major_mm: 50.7, semi_minor_mm: 49.3 }, teeth: { count: 80, installed: 40, radius_mm: 1.5, width_mm: 15 }, ring: { teeth: 78 } },
    load: { input_torque_nm: 3 },
    model: { compatibility: 'projection' },
  },
  slender_fingers: { drive: CASE_5_1, load: { input_torque_nm: 20 }, parts: { carrier: { fingers: 'held_at_one_end' } } },
  finger_overstressed: { drive: CASE_5_1, load: { input_torque_nm: 20 }, parts: { carrier: { fingers: 'held_at_one_end', strength: 'c45-n', finger_fillet_radius_mm: 0.1 } } },
  soft_rim: { drive: CASE_5_1, load: { input_torque_nm: 20 }, parts: { ring: { rim: 'free' } } },
  projection_with_gap: { drive: CASE_5_1, load: { input_torque_nm: 20 }, model: { compatibility: 'projection' }, parts: { ring: { clearance_um: 10 } } },
  deprecated_field: { drive: CASE_5_1, load: { input_torque_nm: 20 }, model: { wave_generator_moves: false } },
  set_back_twice: { drive: CASE_5_1, load: { input_torque_nm: 20 }, parts: { ring: { clearance_um: 1 } }, modification: { ring_equidistant_um: 1 } },
  johnson_beyond_half_width: { drive: CASE_5_1, load: { input_torque_nm: 2000 } },
  friction_beyond_measured: { drive: CASE_5_1, load: { input_torque_nm: 20 }, friction: rubbing(0.2) },
  efficiency_uncertain: { drive: CASE_5_1, load: { input_torque_nm: 20 }, friction: rubbing(0.03) },
  bearing_load_above_half_rating: {
    drive: { wave_generator: { kind: 'eccentric', radius_mm: 30.8, eccentricity_mm: 1.2 }, teeth: { count: 18, radius_mm: 2.5, width_mm: 10 }, ring: { teeth: 19 } },
    load: { input_torque_nm: 2 },
    friction: { wave_generator: { kind: 'rolling', bearing_coefficient: 0.0015, bearing_radius_mm: 25, bearing_load_rating_n: 3000 }, ring: { coefficient: 0.02 }, carrier: { coefficient: 0.02 } },
  },
  stress_above_allowable: { drive: CASE_5_1, load: { input_torque_nm: 20, allowable_stress_mpa: 500 } },
  wind_up_beyond_model: { drive: CASE_5_1, load: { input_torque_nm: 20 }, model: VIRTUAL_WORK, parts: { carrier: { clearance_um: 1000 } } },
  negative_backlash: { drive: CASE_5_1, load: { input_torque_nm: 20 }, sweep: { wind_up: true }, deviations: { slot_angle_arcsec: Array.from({ length: 28 }, (_, slot) => (slot === 3 ? 30 : 0)) } },
};

async function pagesOfReport() {
  const pdf = (await page.pdf({ preferCSSPageSize: true, printBackground: true })).toString('latin1');
  return pdf.match(/\/Type\s*\/Page\b/g).length;
}

/** Runs `look` on the page as paper has it, between its margins. */
async function onPaper(look, argument) {
  await page.emulateMedia({ media: 'print' });
  const { width, height } = page.viewportSize();
  await page.setViewportSize({ width: Math.round((184 / 25.4) * 96), height });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  const seen = await page.evaluate(look, argument);
  await page.evaluate(() => dispatchEvent(new Event('afterprint')));
  await page.setViewportSize({ width, height });
  await page.emulateMedia({ media: null });
  return seen;
}

test('report has one or two pages', async () => {
  page = await open(browser, server, { colorScheme: 'dark' });
  for (const name of ['paper-5.1', 'paper-5.2']) {
    await choose(page, name);
    assert.ok((await pagesOfReport()) <= 2, name);
  }
});

test('long report has two readable pages with every finding', async () => {
  const known = (await (await fetch(`${server.origin}/openapi.json`)).json()).components.schemas.FindingCode;
  const codes = new Set();
  page = await open(browser, server, { colorScheme: 'dark' });
  for (const design of LONG_REPORTS) {
    // The reference differs in nearly every number.
    const { drive, load } = design;
    const others = { parts: PARTS, drive: { ...drive, wave_generator: { ...drive.wave_generator, semi_major_mm: 58.1 } }, load: { ...load, input_torque_nm: 0.83 * load.input_torque_nm } };
    await setDocument({ ...design, ...others });
    await page.click('#keep');
    await setDocument(design);
    const { findings } = (await server.answers(design)).sweep;
    for (const { code } of findings) codes.add(code);
    assert.equal(await pagesOfReport(), 2, `${findings.length} findings`);
    const { table, parts, clearances, wanted, tooSmall, tooWide } = await onPaper(async (found) => {
      const { findingsOf, kindOf } = await import('/page/findings.js');
      const { sentence } = await import('/page/words.js');
      const { number, withUnit } = await import('/page/format.js');
      const small = [];
      const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT, (node) =>
        node.textContent.trim() && node.parentElement.checkVisibility() && !node.parentElement.closest('.hidden, sub') ? NodeFilter.FILTER_ACCEPT : NodeFilter.FILTER_SKIP,
      );
      while (walker.nextNode()) {
        const points = Number.parseFloat(getComputedStyle(walker.currentNode.parentElement).fontSize) * 0.75;
        if (points < 7.99) small.push(`${walker.currentNode.textContent}: ${points} pt`);
      }
      return {
        table: document.querySelector('#findings-table').innerText,
        parts: document.querySelector('.report-parts').innerText.match(/\d+(\.\d+)?/g).map(Number),
        clearances: [...document.querySelectorAll('.report-design tr')].filter((row) => row.innerText.startsWith('Clearance of')).map((row) => Number.parseFloat(row.lastChild.innerText)),
        wanted: findingsOf({ sweep: { findings: found } }).map((finding) => [
          kindOf(finding),
          withUnit(number(finding.value, 5), finding.unit),
          withUnit(number(finding.limit, 5), finding.unit),
          sentence(finding.advice),
        ]),
        tooSmall: small,
        tooWide: [...document.querySelectorAll('table')].filter((candidate) => candidate.getBoundingClientRect().right > innerWidth).map(({ id }) => id),
      };
    }, findings);
    for (const text of wanted.flat()) assert.ok(table.includes(text), `${text} in ${table}`);
    // Clearances are a group of their own, all other values stand with their parts.
    assert.deepEqual(parts, Object.values(PARTS).flatMap(({ clearance_um, ...others }) => Object.values(others)));
    assert.deepEqual(clearances, ['wave_generator', 'ring', 'carrier', 'teeth'].map((part) => PARTS[part].clearance_um));
    assert.deepEqual(tooSmall, []);
    assert.deepEqual(tooWide, []);
  }
  for (const [code, design] of Object.entries(OTHER_REPORTS)) {
    await setDocument(design);
    const { findings } = (await server.answers(design)).sweep;
    for (const finding of findings) codes.add(finding.code);
    assert.ok(codes.has(code), `${code}: ${findings.map((finding) => finding.code)}`);
    assert.ok((await page.textContent('#findings-table')).length > 0 || findings.length === 0, code);
  }
  const others = known.enum.filter((code) => !OF_DRAWINGS.includes(code));
  assert.deepEqual([...codes].sort(), others.sort(), 'every finding of a sweep stands in one of the reports');
});

test('headers set a strict policy and revalidation', async () => {
  const index = await fetch(`${server.origin}/`);
  const policy = index.headers.get('content-security-policy');
  for (const part of ["default-src 'none'", "script-src 'self'", "style-src 'self'", "connect-src 'self'", "frame-ancestors 'none'"]) {
    assert.ok(policy.includes(part), part);
  }
  assert.ok(!policy.includes('unsafe'));
  const etag = (await fetch(`${server.origin}/page/main.js`)).headers.get('etag');
  const again = await fetch(`${server.origin}/page/main.js`, { headers: { 'if-none-match': etag } });
  assert.equal(again.status, 304);
  // A browser takes the headers of a 304. Another policy there would block the page's own scripts.
  assert.equal(again.headers.get('content-security-policy'), policy);
  const missing = await fetch(`${server.origin}/page/nothing.js`);
  assert.equal(missing.status, 404);
  assert.equal(missing.headers.get('content-type'), 'application/problem+json');
});

test('browser draws every part’s SVG to scale', async () => {
  const design = { ...(await server.example('paper-5.2')), parts: { wave_generator: { bore_radius_mm: 20 } } };
  const { semi_major_mm: a, semi_minor_mm: b } = design.drive.wave_generator;
  const { radius_mm: r } = design.drive.teeth;
  const rim = 1.2 * (a + 2 * r);
  page = await open(browser, server);
  const drawn = async (part) => {
    const response = await fetch(`${server.origin}/v1/drawings/${part}`, {
      method: 'POST',
      headers: { 'content-type': 'application/json', accept: 'image/svg+xml' },
      body: JSON.stringify(design),
    });
    return page.evaluate((text) => {
      const svg = new DOMParser().parseFromString(text, 'image/svg+xml').documentElement;
      if (svg.querySelector('parsererror')) throw new Error(svg.textContent);
      document.body.append(svg);
      const paths = [...svg.querySelectorAll('path')];
      const [path] = paths;
      const { width, height } = path.getBBox();
      const has = (x, y) => path.isPointInFill(new DOMPoint(x, y));
      // The shoelace formula along the outline, if there is one.
      const length = path.getTotalLength();
      const points = [...Array(4000).keys()].map((index) => path.getPointAtLength((length * index) / 4000));
      const area = points.reduce((sum, { x, y }, index) => sum + x * points[(index + 1) % 4000].y - points[(index + 1) % 4000].x * y, 0) / 2;
      const result = { count: paths.length, width, height, area, unit: svg.getAttribute('width'), box: svg.viewBox.baseVal.width, atAxis: has(0, 0), atRim: has(0.98 * width / 2, 0) };
      svg.remove();
      return result;
    }, await response.text());
  };
  const near = (found, expected, what) => assert.ok(Math.abs(found / expected - 1) < 2e-3, `${what}: ${found} is not ${expected}`);
  const ring = await drawn('ring');
  near(ring.width, 2 * rim, 'ring');
  assert.deepEqual([ring.count, ring.atAxis, ring.atRim], [1, false, true]);
  assert.match(ring.unit, /mm$/);
  near(Number.parseFloat(ring.unit), ring.box, 'a unit is a millimetre');
  const cam = await drawn('wave-generator');
  near(cam.width, 2 * a, 'cam');
  near(cam.height, 2 * b, 'cam');
  assert.deepEqual([cam.atAxis, cam.atRim], [false, true]);
  const tooth = await drawn('tooth');
  near(tooth.area, Math.PI * r * r, 'tooth');
  const carrier = await drawn('carrier');
  assert.equal(carrier.count, design.drive.teeth.installed);
  assert.equal((await drawn('assembly')).count, 2 + 2 * design.drive.teeth.installed);
});
