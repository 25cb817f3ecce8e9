// Layout is stable, and every control can be reached and hit.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, enter, field, notes, pick, resultOf, setDocument, settled, testBed } from './harness.js';

const RADIUS = '/drive/teeth/radius_mm';
const SEMI_MINOR = '/drive/wave_generator/semi_minor_mm';
const bed = testBed({ before, after, afterEach });

/** Where things stand that a hand or an eye is on. */
const places = (page) =>
  page.evaluate(() =>
    Object.fromEntries(
      ['#mechanism-title', '#whole', '#plots-title', '#table-title', '#accuracy-title', '.field:has(> .entry #field-drive-teeth-radius_mm)', '.field:has(> .entry #field-drive-teeth-width_mm)', '#field-load-input_torque_nm'].map((selector) => [selector, document.querySelector(selector).getBoundingClientRect().top]),
    ),
  );

/** Drags a slider from its middle to shares of its length, and gives the places at each. */
async function dragged(page, pointer, shares) {
  const slider = page.locator(`.field:has(> .entry ${field(pointer)}) input[type=range]`);
  const box = await slider.boundingBox();
  const y = box.y + box.height / 2;
  await page.mouse.move(box.x + box.width / 2, y);
  const all = [await places(page)];
  await page.mouse.down();
  for (const share of shares) {
    const before = await page.inputValue(field(pointer));
    await page.mouse.move(box.x + box.width * share, y);
    // A browser delivers pointer events once a frame.
    await page.waitForFunction(([selector, old]) => document.querySelector(selector).value !== old, [field(pointer), before]);
    await settled(page);
    all.push(await places(page));
  }
  return all;
}

for (const [name, viewport] of Object.entries({ wide: { width: 1366, height: 900 }, tablet: { width: 820, height: 1180 } })) {
  test(`nothing moves while slider passes limits: ${name}`, async () => {
    const page = await bed.open({ viewport });
    // Beyond undercut, and beyond the least semi-minor axis of a cam.
    const all = await dragged(page, RADIUS, [0.75, 0.95, 0.5]);
    for (const each of all) assert.deepEqual(each, all[0]);
    await page.mouse.move(1, 1);
    await page.mouse.up();
    await page.click('#undo');
    await settled(page);
    const passed = await dragged(page, SEMI_MINOR, [0.8, 0.99, 0.5]);
    for (const each of passed) assert.deepEqual(each, passed[0]);
    await page.mouse.up();
  });
}

test('held slider reports findings on top, then at field', async () => {
  const page = await bed.open();
  await dragged(page, RADIUS, [0.75]);
  assert.match(await page.textContent('#status-findings'), /Undercut ring tips/);
  assert.equal(await page.locator(`${notes(RADIUS)} .finding`).count(), 0);
  await page.mouse.up();
  await settled(page);
  assert.match(await page.textContent(notes(RADIUS)), /Undercut ring tips/);
  assert.match(await page.textContent('#findings'), /Undercut ring tips/);
});

test('hidden result table waits while slider is held', async () => {
  const page = await bed.open();
  const gap = () => resultOf(page, 'Least gap between teeth');
  const answered = async () => {
    const design = await bed.server.example('paper-5.1');
    design.drive.teeth.radius_mm = Number(await page.inputValue(field(RADIUS)));
    return (await bed.server.ask('/v1/geometry', design)).teeth.gap_min_mm;
  };
  const before = await gap();
  await dragged(page, RADIUS, [0.55]);
  assert.equal(await gap(), before);
  await page.locator('#table').scrollIntoViewIfNeeded();
  const seen = await answered();
  assert.notEqual(seen, before);
  await page.waitForFunction((wanted) => [...document.querySelectorAll('#table data')].some(({ value }) => Number(value) === wanted), seen);
  await page.evaluate(() => scrollTo(0, 0));
  await page.mouse.up();
  await dragged(page, RADIUS, [0.45]);
  await page.mouse.up();
  await settled(page);
  assert.equal(await gap(), await answered());
});

test('impossible design takes one line, reasons on demand', async () => {
  const page = await bed.open();
  const before = await places(page);
  await enter(page, SEMI_MINOR, 60);
  const after = await places(page);
  for (const place of ['#mechanism-title', '#whole', '#plots-title']) assert.equal(after[place], before[place], place);
  await page.click('#impossible summary');
  await page.click('#impossible-all button:has-text("Semi-major axis")');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'field-drive-wave_generator-semi_major_mm');
});

test('focused field stays while notes above it change', async () => {
  const page = await bed.open();
  await page.focus(field('/drive/ring/teeth'));
  const top = () => page.$eval(field('/drive/ring/teeth'), (input) => input.getBoundingClientRect().top);
  const before = await top();
  await page.keyboard.press('Control+a');
  await page.keyboard.type('2');
  await settled(page);
  assert.ok(Math.abs((await top()) - before) <= 1, `${await top()} is not ${before}`);
});

test('Play is reached within a dozen tab stops', async () => {
  const page = await bed.open();
  let stops = 0;
  for (; stops < 30; stops += 1) {
    if (await page.evaluate(() => document.activeElement.id === 'play')) break;
    await page.keyboard.press('Tab');
  }
  assert.ok(stops <= 12, `${stops} stops`);
});

test('tools are one tab stop with arrow keys', async () => {
  const page = await bed.open();
  const focused = () => page.evaluate(() => document.activeElement.textContent);
  await page.focus('#keep');
  await page.keyboard.press('ArrowRight');
  assert.equal(await focused(), 'Download');
  await page.keyboard.press('End');
  assert.equal(await focused(), 'Menu');
  await page.keyboard.press('ArrowRight');
  assert.equal(await focused(), 'Examples');
  await page.keyboard.press('ArrowRight');
  assert.equal(await focused(), 'Keep as reference', 'undo and redo have nothing to do yet');
  assert.equal(await page.locator('#tools [tabindex="0"]').count(), 1);
});

test('names and placeholders are never cut', async () => {
  const design = await bed.server.example('paper-5.1');
  design.model = { compatibility: 'virtual_work', stiffness: { law: 'johnson' } };
  design.friction = { wave_generator: { kind: 'plain', coefficient: 0.05 }, ring: { coefficient: 0.05 }, carrier: { coefficient: 0.05 } };
  // A natural tip radius with three digits and a point.
  const roller = { ...(await bed.server.example('eccentric-roller')), friction: design.friction };
  const page = await bed.open();
  for (const [shown, width, height] of [design, roller].flatMap((shown) => [[shown, 320, 640], [shown, 768, 1024], [shown, 1366, 900], [shown, 1920, 1080]])) {
    await page.setViewportSize({ width, height });
    if (width === 320) await setDocument(page, shown);
    const cut = await page.evaluate(() => {
      for (const details of document.querySelectorAll('#form details')) details.open = true;
      const pen = document.createElement('canvas').getContext('2d');
      const isCut = (input) => {
        const { fontFamily, paddingLeft, paddingRight } = getComputedStyle(input);
        pen.font = `${getComputedStyle(input, '::placeholder').fontSize} ${fontFamily}`;
        return pen.measureText(input.placeholder).width > input.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
      };
      const names = [...document.querySelectorAll('.tile dt > span')].filter((name) => name.checkVisibility());
      const empty = [...document.querySelectorAll('#form .entry input:placeholder-shown')].filter((input) => input.checkVisibility() && input.placeholder.trim());
      return {
        seen: [names.length, empty.length > 10],
        names: names.filter((name) => name.scrollWidth > name.clientWidth).map((name) => name.textContent),
        words: empty.filter(isCut).map((input) => input.placeholder),
      };
    });
    assert.deepEqual(cut, { seen: [7, true], names: [], words: [] }, `${width} px`);
  }
});

test('tools take one row on small and wide screens', async () => {
  const heightOf = (selector) => bed.page.$eval(selector, (element) => element.getBoundingClientRect().height);
  await bed.open({ viewport: { width: 390, height: 844 } });
  assert.ok((await heightOf('#tools')) < 45);
  assert.ok((await heightOf('#views')) < 60);
  await bed.page.context().close();
  await bed.open();
  const [views, tools] = await Promise.all(['#views', '#tools'].map((selector) => bed.page.locator(selector).boundingBox()));
  assert.ok(Math.abs(views.y + views.height / 2 - tools.y - tools.height / 2) < 12, `${views.y}, ${tools.y}`);
});

test('page fits 320 px with targets of 24 px', async () => {
  const page = await bed.open({ viewport: { width: 320, height: 640 } });
  await page.click('#keep');
  await setDocument(page, { ...(await bed.server.example('paper-5.2')), sweep: { wind_up: true }, model: { compatibility: 'virtual_work', stiffness: { law: 'fixed', wave_generator_n_per_mm: 5e5, ring_n_per_mm: 5e5, carrier_n_per_mm: 5e5 } }, parts: { ring: { clearance_um: 1 } }, load: { input_torque_nm: 3, allowable_stress_mpa: 1500 } });
  for (const details of await page.$$('main details:not([open]) > summary')) if (await details.isVisible()) await details.click();
  const seen = () =>
    page.evaluate(() => ({
      overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
      small: [...document.querySelectorAll('input[type=range], button, summary, select, .button')]
        .filter((element) => element.checkVisibility() && !element.closest('p, .hidden'))
        .map((element) => [element.id || element.className || element.textContent, element.getBoundingClientRect()])
        .filter(([, { width, height }]) => height < 24 || width < 24)
        .map(([name, { width, height }]) => `${name}: ${width} × ${height}`),
    }));
  assert.deepEqual(await seen(), { overflow: 0, small: [] });
  await enter(page, SEMI_MINOR, 70);
  assert.equal((await seen()).overflow, 0);
  await pick(page, '#help');
  assert.equal((await seen()).overflow, 0);
});
