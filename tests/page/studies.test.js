// Studies on the page: a search for a drive, curves and maps, sensitivity and tolerances.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { readFile } from 'node:fs/promises';
import { after, afterEach, before, test } from 'node:test';
import { choose, designOf, enter, field, notes, pick, settled, testBed } from './harness.js';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const RADIUS = '/drive/teeth/radius_mm';
const SEMI_MAJOR = '/drive/wave_generator/semi_major_mm';
const VIEWS = ['find', 'explore', 'sensitivity', 'tolerance'];

const bed = testBed({ before, after, afterEach });

/** The number that a text ends or begins with, as people write it. */
const numberIn = (text) => Number(/[\d.\u202f]+/.exec(text.replace('−', '-'))[0].replaceAll('\u202f', ''));

async function show(page, view) {
  await page.click(`#views [data-view="${view}"]`);
}

/** Waits until a study's view shows what came. */
const done = (page, view, selector) =>
  page.waitForFunction(
    ([root, wanted]) => document.querySelector(`${root} .study-progress`).hidden && document.querySelector(`${root} ${wanted}`) !== null,
    [`#${view}`, selector],
  );

async function range(page, row, from, to) {
  await page.locator('#explore .ask-row').nth(row).locator('input').first().fill(String(from));
  await page.locator('#explore .ask-row').nth(row).locator('input').last().fill(String(to));
  await page.keyboard.press('Tab');
}

const over = (page, row, pointer) => page.locator('#explore .ask-row').nth(row).locator('select').selectOption(pointer);

/** Begins a search with these requirements, of one kind with little effort, and waits for its end. */
async function find(page, requirements = {}) {
  await show(page, 'find');
  for (const kind of ['ellipse', 'eccentric']) await page.uncheck(field(`/find/wave_generators/${kind}`));
  await page.selectOption(field('/find/effort'), 'quick');
  for (const [name, value] of Object.entries(requirements)) await page.fill(field(`/find/${name}`), String(value));
  await page.click('.find button[type=submit]');
  await found(page);
}

const found = (page) => page.waitForFunction(() => document.querySelector('#find .study-progress').hidden && document.querySelector('#find .headline')?.textContent);

/** Of all that can deviate, only this does, evenly. */
async function onlyDeviates(page, ...labels) {
  await page.waitForSelector('#tolerance .deviation:visible');
  const rows = page.locator('#tolerance .deviation:visible');
  for (let index = 0; index < (await rows.count()); index += 1) await rows.nth(index).locator('select').selectOption('none');
  for (const label of labels) await page.locator('#tolerance .deviation', { hasText: label }).locator('select').selectOption('uniform');
}

test('tab and arrow keys reach every view', async () => {
  const page = await bed.open();
  const focused = () => page.evaluate(() => document.activeElement.closest('#views button')?.dataset.view);
  let stops = 0;
  while ((await focused()) === undefined) {
    await page.keyboard.press('Tab');
    stops += 1;
    assert.ok(stops <= 12, 'a dozen stops at most');
  }
  for (const view of VIEWS) {
    await page.keyboard.press('ArrowRight');
    assert.equal(await focused(), view);
    await page.keyboard.press('Enter');
    assert.ok(await page.isVisible(`#${view}`), view);
    assert.equal(await page.getAttribute(`#views [data-view="${view}"]`, 'aria-pressed'), 'true');
    for (const other of VIEWS) if (other !== view) assert.ok(!(await page.isVisible(`#${other}`)), `${other} beside ${view}`);
    assert.equal(await page.isVisible('#whole'), false, 'the mechanism gives way');
  }
  await page.keyboard.press('Home');
  await page.keyboard.press('Enter');
  assert.ok(await page.isVisible('#whole'));
});

test('every view fits 320 px and is accessible', async () => {
  for (const options of [{ viewport: { width: 320, height: 900 }, colorScheme: 'dark' }, {}]) {
    await bed.page?.context().close();
    const page = await bed.open(options);
    await page.evaluate(await readFile(AXE, 'utf8'));
    await find(page);
    for (const view of VIEWS) {
      await show(page, view);
      if (view === 'explore') {
        await over(page, 2, SEMI_MAJOR);
        await done(page, view, '.heat');
      } else if (view === 'tolerance') {
        await onlyDeviates(page, 'Width of all teeth');
        await done(page, view, 'tbody tr');
      } else if (view !== 'find') await done(page, view, 'tbody tr');
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= page.viewportSize().width, view);
      const { violations } = await page.evaluate(() => window.axe.run());
      assert.deepEqual(violations.map(({ id, nodes }) => `${view} ${id}: ${nodes.map(({ html }) => html).join(' | ')}`), []);
    }
  }
});

test('study axes at 320 px keep names and numbers', async () => {
  const page = await bed.open({ viewport: { width: 320, height: 900 } });
  await show(page, 'tolerance');
  await onlyDeviates(page, 'Width of all teeth');
  await done(page, 'tolerance', 'tbody tr');
  const axes = await page.$$eval('#tolerance .chart-svg', (charts) =>
    charts.map((chart) => {
      const { left, right } = chart.getBoundingClientRect();
      const isOut = (text) => text.getBoundingClientRect().left < left - 1 || text.getBoundingClientRect().right > right + 1;
      return {
        cut: [...chart.querySelectorAll('.axis-label')].filter(isOut).map(({ textContent }) => textContent),
        numbers: ['middle', 'end'].map((anchor) => chart.querySelectorAll(`.ticks [text-anchor='${anchor}']`).length >= 2),
      };
    }),
  );
  assert.deepEqual(axes, [1, 2].map(() => ({ cut: [], numbers: [true, true] })));
  await show(page, 'find');
  const rows = await page.$$eval('#find .flag', (flags) =>
    flags.filter((flag) => flag.checkVisibility()).map((flag) => [flag.querySelector('label').textContent, flag.querySelector('label').getBoundingClientRect().top < flag.querySelector('input').getBoundingClientRect().bottom]),
  );
  assert.deepEqual(rows.filter(([, isBeside]) => !isBeside), []);
  assert.ok(rows.length > 8, `${rows.length}`);
});

test('curve matches the sweep and applies to the design', async () => {
  const page = await bed.open();
  await show(page, 'explore');
  await done(page, 'explore', '.curve');
  const readout = page.locator('#explore .study-readout strong');
  assert.equal(numberIn(await readout.textContent()), 980.44, 'of the design at first');
  await page.locator('#explore .study-place input').first().fill('120');
  const shown = numberIn(await readout.textContent());
  await page.click('#explore button:has-text("Use in the design")');
  await settled(page);
  const design = await designOf(page);
  assert.equal(design.drive.teeth.radius_mm, 6, '120 of 160 steps from 3 to 7');
  const { peaks } = await bed.server.ask('/v1/sweep', design);
  const largest = Math.max(...Object.values(peaks).map(({ stress_mpa: stress }) => stress.value));
  assert.ok(Math.abs(largest - shown) <= 5e-5 * largest, `${largest} is shown as ${shown}`);
  await page.click('#undo');
  await settled(page);
  assert.equal((await designOf(page)).drive.teeth.radius_mm, 5);
});

test('curve has a gap with reason for impossible drives', async () => {
  const page = await bed.open();
  await show(page, 'explore');
  await done(page, 'explore', '.curve');
  await range(page, 1, 6, 9);
  await done(page, 'explore', '.impossible-band');
  assert.match(await page.textContent('#explore .study-reasons'), /Impossible here.*of 161, the first at tooth radius 7\.\d+.mm: Neighbouring teeth.*come as near as/);
  await page.locator('#explore .study-place input').first().fill('160');
  assert.match(await page.textContent('#explore .study-readout'), /Tooth radius 9.mm: impossible – neighbouring teeth/);
  assert.ok(await page.isDisabled('#explore button:has-text("Use in the design")'));
});

test('map point applies two numbers to the design', async () => {
  const page = await bed.open();
  await show(page, 'explore');
  await over(page, 2, SEMI_MAJOR);
  await done(page, 'explore', '.heat');
  assert.match(await page.textContent('#explore .study-reasons'), /semi-minor/i, 'axes that are no ellipse’s');
  await page.click('#explore button:has-text("Least")');
  const shown = numberIn(await page.textContent('#explore .study-readout strong'));
  await page.click('#explore button:has-text("Use in the design")');
  await settled(page);
  const design = await designOf(page);
  assert.notEqual(design.drive.teeth.radius_mm, 5);
  assert.notEqual(design.drive.wave_generator.semi_major_mm, 58);
  const { peaks } = await bed.server.ask('/v1/sweep', design);
  const largest = Math.max(...Object.values(peaks).map(({ stress_mpa: stress }) => stress.value));
  assert.ok(Math.abs(largest - shown) <= 5e-5 * largest);
});

test('slots vary together with ring teeth', async () => {
  const page = await bed.open();
  await enter(page, '/drive/teeth/installed', '');
  await show(page, 'explore');
  await over(page, 1, '/drive/teeth/count');
  await done(page, 'explore', '.curve-dot');
  assert.equal(await page.locator('#explore .curve-dot').count(), 17, 'from 20 to 36, none impossible');
  await page.locator('#explore .study-place input').first().fill('0');
  await page.click('#explore button:has-text("Use in the design")');
  await settled(page);
  const { teeth, ring } = (await designOf(page)).drive;
  assert.deepEqual([teeth.count, ring.teeth], [20, 18]);
});

test('map of a million variants is thinned in drawing', async () => {
  const page = await bed.open();
  const steps = 1000;
  const values = Array.from({ length: steps }, (_, index) => 1 + index);
  const variant = Array.from({ length: steps * steps }, (_, index) => index);
  const result = {
    study: 'map',
    is_complete: true,
    variants: steps * steps,
    over: [{ pointer: RADIUS, values }, { pointer: SEMI_MAJOR, values }],
    possible: { variant, quantities: { peak_stress_mpa: variant.map((index) => index % 1000) } },
    impossible: { variant: [], reason: [] },
    reasons: [],
  };
  await show(page, 'explore');
  await done(page, 'explore', '.curve');
  await page.route('**/v1/studies', (route) => route.fulfill({ json: { id: 'x', state: 'done', variants: steps * steps, looked_at: steps * steps, result } }));
  let workers = 0;
  page.on('worker', () => (workers += 1));
  await over(page, 2, SEMI_MAJOR);
  await page.locator('#explore .ask-row').first().locator('select').nth(1).selectOption('finest');
  await page.waitForFunction(() => document.querySelector('#explore .study-state').textContent.includes('press “Calculate”'));
  assert.match(await page.textContent('#explore .study-state'), /1\u202f000\u202f000 variants are many/);
  const before = workers;
  await page.click('#explore button:has-text("Calculate")');
  await page.waitForFunction(() => document.querySelector('#explore .heat-legend').textContent.includes('one step in 3 is drawn'));
  assert.ok(workers > before);
  const size = await page.$eval('#explore .heat', async (image) => {
    const drawn = new Image();
    drawn.src = image.getAttribute('href');
    await drawn.decode();
    return [drawn.naturalWidth, drawn.naturalHeight];
  });
  assert.deepEqual(size, [334, 334]);
});

test('ratio, torque and space give drives to open', async () => {
  const page = await bed.open();
  await find(page, { ratio: 20, output_torque_nm: 200, outer_diameter_mm: 120 });
  assert.match(await page.textContent('#find .headline'), /\d+ drives meet all limits \(Pareto front\)/);
  const rows = page.locator('#find .drives-scroll tbody tr');
  assert.ok((await rows.count()) > 5);
  await page.waitForSelector('#find .drive-card .part-ring');
  await rows.nth(2).locator('button').click();
  assert.equal(await page.textContent('#find .drive-card h3'), 'Drive 3');
  await page.click('#find button:has-text("Open as design")');
  await settled(page);
  assert.ok(await page.isVisible('#whole'));
  assert.match(await page.textContent('#design-name'), /^Drive 3, /);
  const design = await designOf(page);
  const { geometry, sweep } = await bed.server.answers(design);
  assert.equal(geometry.transmission_ratio, 20);
  assert.equal(geometry.undercut.occurs, false);
  assert.ok(2 * 1.2 * geometry.ring.root_radius_mm <= 120);
  assert.ok(sweep.torque_capacity.output_torque_nm >= 200);
  assert.equal(sweep.load.output_torque_nm, 200);
  // The limits cover all warnings.
  assert.deepEqual(geometry.findings.filter(({ severity }) => severity === 'warning'), []);
});

test('table of drives keeps thousands readable', async () => {
  const page = await bed.open();
  await show(page, 'find');
  await page.check(field('/find/goals/stiff'));
  await find(page);
  const head = await page.$$eval('#find .drives-scroll thead th', (cells) => cells.map((cell) => cell.textContent));
  const place = head.findIndex((text) => /stiffness/.test(text));
  const cells = await page.$$eval('#find .drives-scroll tbody tr', (rows) => rows.map((row) => [...row.querySelectorAll('th, td')].map((cell) => cell.textContent)));
  const unnamed = head.length - cells[0].length;
  const stiffness = cells.map((row) => Number(row[place - unnamed].replaceAll('\u202f', '')));
  assert.ok(Math.max(...stiffness) > 1e5 && Math.min(...stiffness) > 1e4, `${stiffness}`);
  await page.click('#find button:has-text("Open as design")');
  await settled(page);
  const { sweep } = await bed.server.answers({ ...(await designOf(page)), sweep: { samples: 50, wind_up: true } });
  const least = Math.min(...sweep.wind_up.torsional_stiffness_nm_per_rad);
  assert.ok(Math.abs(stiffness[0] / least - 1) < 0.01, `${stiffness[0]}, not ${least}`);
});

test('smallest drive has no findings and all drawings', async () => {
  const page = await bed.open();
  await find(page);
  assert.match(await page.textContent('#find .drive-card h3'), /^Drive 1$/);
  assert.match(await page.textContent('#find .drive-card'), /Close to its limits: \S|Not close to any limit/, 'what holds the smallest one back');
  await page.click('#find button:has-text("Open as design")');
  await settled(page);
  const design = await designOf(page);
  const { geometry, sweep } = await bed.server.answers(design);
  assert.deepEqual([...geometry.findings, ...sweep.findings].map(({ code }) => code), []);
  assert.ok(geometry.carrier.radial_space_mm >= 3 * (1 - 1e-9));
  const held = sweep.series_compliance_estimates.find(({ contact, is_as_held: isAsHeld }) => contact === 'carrier' && isAsHeld);
  assert.deepEqual([sweep.fingers.fingers, held.backing, design.model.series_compliance_mm_per_n], ['far_ends_joined', 'finger_joined_at_far_end', 'estimated']);
  assert.ok(sweep.fingers.safety >= 1.5 * (1 - 1e-6));
  assert.ok(sweep.torque_capacity.output_torque_nm >= 200);
  for (const part of ['assembly', 'ring', 'wave-generator', 'carrier', 'tooth']) {
    // One file for each part, since Chromium drops downloads beyond ten a second.
    const [download] = await Promise.all([page.waitForEvent('download'), pick(page, `[data-file="${part}.dxf"]`)]);
    assert.ok((await readFile(await download.path())).length > 500, part);
    for (const [accept, beginning] of [['model/step', 'ISO-10303-21;'], ['image/svg+xml', '<svg ']]) {
      const file = await bed.server.file(`/v1/drawings/${part}`, design, accept);
      assert.equal(file.toString('utf8', 0, beginning.length), beginning, part);
    }
  }
});

test('figures of a drive are beside or below it', async () => {
  const page = await bed.open();
  await find(page);
  const box = (selector) => page.locator(`#find ${selector}`).boundingBox();
  const [chart, figures, card] = await Promise.all(['.drive-chart', '.drive-figures', '.drive-card'].map(box));
  assert.ok(figures.y - (chart.y + chart.height) < 20 && figures.x + figures.width <= card.x, JSON.stringify({ chart, figures, card }));
  assert.match(await page.textContent('#find .drive-figures h3'), /^Drive 1 in figures$/);
  await page.setViewportSize({ width: 768, height: 1024 });
  const [narrow, below] = await Promise.all(['.drive-card', '.drive-figures'].map(box));
  assert.ok(below.y >= narrow.y + narrow.height);
});

test('reasons of failed drives are counted', async () => {
  const page = await bed.open();
  await find(page);
  const reasons = page.locator('#find [aria-labelledby="reasons-title"]');
  assert.match(await reasons.textContent(), /Before the search \d.* variants were spread evenly over the free numbers/);
  const rows = await reasons.locator('tbody tr').allTextContents();
  assert.ok(rows.some((row) => /^Torque capacity, output at least 200.N·m/.test(row)), rows.join('\n'));
  assert.match(await reasons.locator('details').first().textContent(), /such as: /);
});

test('two drives are compared at one scale', async () => {
  const page = await bed.open();
  await find(page);
  const checks = page.locator('#find .drives-scroll input[type=checkbox]');
  await checks.nth(0).check();
  assert.match(await page.textContent('#comparison-title'), /Drive 1, and…/);
  await checks.nth(4).check();
  assert.equal(await page.textContent('#comparison-title'), 'Drive 1 and drive 5');
  // Pictures are drawn when they become visible.
  await page.locator('#find .pair').scrollIntoViewIfNeeded();
  const viewBoxes = () => page.$$eval('#find .pair svg', (pictures) => pictures.map((picture) => picture.getAttribute('viewBox')));
  await page.waitForFunction(() => document.querySelectorAll('#find .pair svg').length === 2);
  const [one, other] = await viewBoxes();
  assert.equal(one, other);
  await page.click('#find button:has-text("Open drive 5, drive 1 as reference")');
  await page.waitForSelector('#comparing:not([hidden])');
  await settled(page);
  assert.match(await page.textContent('#design-name'), /^Drive 5/);
  assert.match(await page.textContent('#reference-name'), /^Drive 1/);
});

/** The lengths of a found design in mm, but for the standard ones. */
const lengths = ({ drive: { wave_generator: wave, teeth } }) => [wave.radius_mm, wave.eccentricity_mm, wave.mean_path_radius_mm, wave.amplitude_mm, wave.semi_major_mm, wave.semi_minor_mm, teeth.width_mm].filter((value) => value !== undefined);
const isRound = (value) => Number(value.toFixed(2)) === value;
const kept = (page) => page.evaluate(() => JSON.parse(sessionStorage.getItem('found')).found);

test('found drives have rounded lengths and meet limits', async () => {
  const page = await bed.open();
  await find(page);
  const { front } = await kept(page);
  assert.ok(front.length > 5 && front.length <= 40, `${front.length}`);
  for (const { design } of front) assert.ok([...lengths(design), design.drive.teeth.radius_mm].every(isRound), JSON.stringify(design.drive));
  for (const { design } of [front[0], front.at(-1)]) {
    const { geometry, sweep } = await bed.server.answers(design);
    assert.ok(2.4 * geometry.ring.root_radius_mm <= 120 && sweep.torque_capacity.output_torque_nm >= 200, JSON.stringify(design.drive));
    assert.ok(geometry.carrier.radial_space_mm >= 3 * (1 - 1e-9) && !geometry.undercut.occurs && design.drive.teeth.width_mm <= 30);
  }
});

test('standard diameters are a choice', async () => {
  const page = await bed.open();
  await show(page, 'find');
  await page.check(field('/find/standard'));
  await find(page);
  const { front } = await kept(page);
  assert.ok(front.length > 1);
  for (const { design } of front) assert.ok((4 * design.drive.teeth.radius_mm) % 1 === 0, `diameter ${2 * design.drive.teeth.radius_mm} mm`);
});

test('found drives survive reload and Back', async () => {
  const page = await bed.open();
  await find(page);
  const before = await page.textContent('#find .drives');
  await page.reload();
  await settled(page);
  assert.ok(await page.isVisible('#find'), 'the address holds the view');
  assert.equal(await page.textContent('#find .drives'), before);
  await page.click('#find button:has-text("Open as design")');
  await settled(page);
  assert.ok(await page.isVisible('#whole'));
  await page.goBack();
  await page.waitForSelector('#find', { state: 'visible' });
  assert.equal(await page.textContent('#find .drives'), before);
  await page.goBack();
  await page.waitForSelector('#whole', { state: 'visible' });
});

test('Find drives is visible and explains its result', async () => {
  for (const viewport of [{ width: 1440, height: 900 }, { width: 768, height: 1024 }, { width: 390, height: 844 }]) {
    await bed.page?.context().close();
    const page = await bed.open({ viewport });
    await show(page, 'find');
    const { y, height } = await page.locator('.find button[type=submit]').boundingBox();
    assert.ok(y >= 0 && y + height <= viewport.height, `${viewport.width}: ${y}`);
    assert.match(await page.textContent('#find .preview'), /You will see here:.*trade-offs.*limit to relax/s);
  }
});

test('value beyond its limit never looks equal', async () => {
  const page = await bed.open();
  const shown = await page.evaluate(async () => {
    const { apart } = await import('/page/reasons.js');
    const { number } = await import('/page/format.js');
    const quantities = { shown: (_, value, digits = 4) => number(value, digits) };
    return [[80.00004, 80], [199.996, 200], [80, 80]].map(([value, limit]) => apart(quantities, '', value, limit));
  });
  assert.deepEqual(shown, ['80.00004', '199.996', '80']);
});

test('tolerances start from grades of each part', async () => {
  const page = await bed.open({ example: null });
  await show(page, 'tolerance');
  await page.waitForSelector('#tolerance .deviation:visible');
  const rows = await page.$$eval('#tolerance .deviation', (lines) => lines.map((line) => [line.querySelector('span').textContent, line.querySelector('select').value, line.lastChild.textContent]));
  const graded = rows.filter(([, value]) => value.startsWith('IT')).map(([label, value, zone]) => `${label} ${value}: ${zone}`);
  // ISO 286-1, up to 10 mm: IT6 is 9 µm and IT7 15 µm of a diameter or a width.
  assert.deepEqual(graded, ['Radius of each tooth IT6: 0 to 4.5\u202fµm, normal', 'Wall of each slot IT7: 0 to 7.5\u202fµm, normal', 'Depth of each ring space IT7: 0 to 7.5\u202fµm, normal']);
  const asked = page.waitForRequest('**/v1/studies');
  await page.click('#tolerance button:has-text("Sample drives")');
  const question = (await asked).postDataJSON();
  assert.deepEqual(question.base.modification, { tooth_radius_um: 2.25, slot_wall_um: 3.75, ring_equidistant_um: 3.75 }, 'the middles of the zones');
  assert.deepEqual(question.deviations.slot_wall_um, { distribution: 'normal', limit: 3.75, sigma: 1.25 });
  await page.click('#tolerance .study-progress button');
  // Parts within these zones always fit together.
  let study = await bed.server.ask('/v1/studies', { ...question, samples: 10, quantities: ['peak_stress_mpa'] });
  while (study.state === 'running') study = await (await fetch(`${bed.server.origin}/v1/studies/${study.id}`)).json();
  const { interference, impossible } = await (await fetch(bed.server.origin + study.result_href)).json();
  assert.deepEqual([interference, impossible], [0, 0]);
});

test('labels of an axis differ', async () => {
  const page = await bed.open();
  const texts = await page.evaluate(async () => {
    const { axes } = await import('/page/chart.js');
    const { root } = axes(600, 300, { label: 'x', min: 1519.96, max: 1520.04 }, { label: 'y', min: 1e-9, max: 1.0001e-9 });
    return ['middle', 'end'].map((anchor) => [...root.querySelectorAll(`.ticks [text-anchor='${anchor}']`)].map(({ textContent }) => textContent));
  });
  for (const labels of texts) assert.ok(labels.length >= 2 && new Set(labels).size === labels.length, labels.join(', '));
});

test('impossible search offers a smallest sufficient change', async () => {
  const page = await bed.open();
  await find(page, { outer_diameter_mm: 60 });
  assert.equal(await page.textContent('#find .headline'), 'No drive meets all limits.');
  assert.match(await page.textContent('#find .study-state'), /Relax one of these limits, all others kept:.*instead of.*The nearest drive breaks: /);
  const change = page.locator('#find .miss li', { hasText: 'Outer diameter' }).locator('button').first();
  await change.click();
  await found(page);
  assert.ok(Number(await page.inputValue(field('/find/outer_diameter_mm'))) > 60);
});

test('cancelled search says so', async () => {
  const page = await bed.open();
  await show(page, 'find');
  await page.selectOption(field('/find/effort'), 'thorough');
  let cancelled;
  page.on('request', (request) => (cancelled ??= request.method() === 'DELETE' ? request : undefined));
  await page.click('.find button[type=submit]');
  await page.waitForFunction(() => /of 200.000 variants/.test(document.querySelector('#find .study-progress').textContent));
  await page.click('#find .study-progress button');
  await page.waitForFunction(() => document.querySelector('#find .headline')?.textContent.startsWith('Cancelled'));
  assert.match(cancelled.url(), /\/v1\/studies\/[0-9a-f]+$/);
  const { state } = await (await fetch(cancelled.url())).json();
  assert.equal(state, 'cancelled');
});

test('bad requirements are reported at their fields', async () => {
  const page = await bed.open();
  await show(page, 'find');
  let asked = 0;
  page.on('request', (request) => (asked += request.url().endsWith('/v1/studies') ? 1 : 0));
  await page.fill(field('/find/output_torque_nm'), '');
  assert.match(await page.textContent(notes('/find/output_torque_nm')), /Required: output torque, a number in N·m, such as 200/);
  await page.fill(field('/find/ratio_max'), '15');
  assert.match(await page.textContent(notes('/find/ratio_max')), /range is empty/);
  for (const goal of ['small', 'strong']) await page.uncheck(field(`/find/goals/${goal}`));
  assert.match(await page.textContent(notes('/find/goals')), /choose at least one/i);
  await page.click('.find button[type=submit]');
  assert.match(await page.textContent('#find .study-state'), /marked fields/);
  assert.equal(asked, 0);
});

test('sensitivity ranks inputs by their effect', async () => {
  const page = await bed.open();
  await show(page, 'sensitivity');
  await done(page, 'sensitivity', 'tbody tr');
  const rows = await page.$$eval('#sensitivity tbody tr', (lines) => lines.map((line) => [...line.querySelectorAll('th, td')].map((cell) => cell.textContent)));
  assert.match(rows[0][0], /^Semi-major axis 58/);
  const design = await bed.server.example('paper-5.1');
  const largest = async (semiMajor) => {
    const moved = structuredClone(design);
    moved.drive.wave_generator.semi_major_mm = semiMajor;
    const { peaks } = await bed.server.ask('/v1/sweep', moved);
    return Math.max(...Object.values(peaks).map(({ stress_mpa: stress }) => stress.value));
  };
  const base = await largest(58);
  for (const [cell, value] of [[2, await largest(58 * 0.99)], [3, await largest(58 * 1.01)]]) {
    assert.equal(numberIn(rows[0][cell]), Number(Math.abs(value - base).toPrecision(3)), 'as a sweep of its own');
  }
  // Moved by its tolerance, the axis has less effect than other inputs moved by 1 %.
  await page.locator('#sensitivity tbody tr').first().locator('input').fill('0.0001');
  await page.keyboard.press('Tab');
  await page.waitForFunction(() => !document.querySelector('#sensitivity tbody th').textContent.startsWith('Semi-major'));
  await page.click('#sensitivity button:has-text("Move all by 1 % again")');
  await page.waitForFunction(() => document.querySelector('#sensitivity tbody th').textContent.startsWith('Semi-major'));
});

test('tolerances report spread, yield and main contributor', async () => {
  const page = await bed.open();
  await show(page, 'tolerance');
  await onlyDeviates(page, 'Radius of all teeth', 'Width of all teeth');
  await page.locator('#tolerance .ask-row').first().locator('select').nth(1).selectOption('1000');
  await page.locator('#tolerance .ask-row').first().locator('select').first().selectOption('peak_stress_mpa');
  await page.waitForFunction(() => /Peak stress.*Width of all teeth/s.test(document.querySelector('#tolerance .tolerance-tables').textContent));
  // Stress goes as the root of the width: 15 mm ± 0.05 mm moves 980.44 MPa uniformly by half of a third of a percent.
  const quantile = async (share) => numberIn(await page.locator('#tolerance tr', { hasText: new RegExp(`^${share}.%`) }).locator('td').first().textContent());
  const median = await quantile(50);
  assert.ok(Math.abs(median - 980.44) < 0.3, String(median));
  const expected = 980.44 * (1 + 0.5 * (0.05 / 15) * 0.9);
  assert.ok(Math.abs((await quantile(95)) - expected) < 0.3, `${await quantile(95)} beside ${expected}`);
  assert.match(await page.locator('#tolerance tr', { hasText: 'Width of all teeth' }).textContent(), /(100|9\d(\.\d+)?).%/, 'nearly all of the variance');
  await page.locator('#tolerance .range input').nth(1).fill('980.44');
  await page.keyboard.press('Tab');
  await page.waitForFunction(() => /of the drives are good/.test(document.querySelector('#tolerance .headline').textContent));
  const good = numberIn(await page.textContent('#tolerance .headline'));
  assert.ok(good > 40 && good < 60, `${good} % lie below the middle`);
});

test('quantiles a thousandth apart are displayed differently', async () => {
  const page = await bed.open();
  await choose(page, 'harmonic-three-lobes');
  await show(page, 'tolerance');
  await onlyDeviates(page, 'Width of all teeth');
  await page.locator('#tolerance .ask-row').first().locator('select').nth(1).selectOption('1000');
  await page.locator('#tolerance .ask-row').first().locator('select').first().selectOption('transmission_error_peak_to_peak_deg');
  await page.waitForFunction(() => /Transmission error.*·10⁻/s.test(document.querySelector('#tolerance .tolerance-tables').textContent) && document.querySelector('#tolerance .study-progress').hidden);
  const shares = page.locator('#tolerance .tolerance-tables table').first().locator('tbody tr', { hasText: /^[\d.]+.%/ });
  const values = await shares.locator('td:first-of-type').allTextContents();
  assert.ok(values.length > 5 && values.every((text) => /·10⁻/.test(text)), values.join(', '));
  assert.equal(new Set(values).size, values.length, values.join(', '));
});

test('deviations say they need virtual work and gaps', async () => {
  const page = await bed.open();
  await show(page, 'tolerance');
  await onlyDeviates(page, 'Depth of each ring space');
  await page.waitForFunction(() => /need virtual work/.test(document.querySelector('#tolerance .study-state').textContent));
  await page.selectOption(field('/model/compatibility'), 'virtual_work');
  await page.waitForFunction(() => /take a while/.test(document.querySelector('#tolerance .study-state').textContent));
  await page.click('#tolerance button:has-text("Sample drives")');
  await page.waitForFunction(() => /100 of 100 cannot be put together: increase the clearances/.test(document.querySelector('#tolerance .headline').textContent));
});

test('changed design repeats its study', async () => {
  const page = await bed.open();
  await show(page, 'sensitivity');
  await done(page, 'sensitivity', 'tbody tr');
  assert.match(await page.textContent('#sensitivity .headline'), /980\.4/);
  await page.fill(field(RADIUS), '4');
  await page.waitForFunction(() => /1026/.test(document.querySelector('#sensitivity .headline').textContent));
});

test('every view prints the design’s report', async () => {
  const page = await bed.open();
  await show(page, 'find');
  await page.emulateMedia({ media: 'print' });
  assert.ok(!(await page.isVisible('#find')));
  assert.ok(await page.isVisible('#table'));
});
