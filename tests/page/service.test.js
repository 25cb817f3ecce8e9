// A service that hangs, one that needs a key, and very large answers.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtemp, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, afterEach, before, test } from 'node:test';
import { BINARY, enter, field, open, pick, resultOf, Server, settled, testBed } from './harness.js';

const RADIUS = '/drive/teeth/radius_mm';
// A busy machine needs longer.
const bed = testBed({ before, after, afterEach }, ['--deadline-ms', '60000']);

test('page reports a hanging service and recovers', async () => {
  const page = await bed.open();
  page.expectsOutage = true;
  bed.server.process.kill('SIGSTOP');
  try {
    await page.fill(field(RADIUS), '4.5');
    await page.waitForSelector('#slow:not([hidden])', { timeout: 5000 });
    assert.match(await page.textContent('#slow'), /Calculating for \d+ s/);
    await page.waitForSelector('#away:not([hidden])', { timeout: 12_000 });
    assert.match(await page.textContent('#away'), /does not answer.*design is kept/);
  } finally {
    bed.server.process.kill('SIGCONT');
  }
  await page.waitForSelector('#away', { state: 'hidden' });
  await settled(page);
  assert.ok(await page.isHidden('#slow'));
  assert.equal(await resultOf(page, 'Ring tip radius'), (await bed.server.ask('/v1/geometry', { ...(await bed.server.example('paper-5.1')), drive: { ...(await bed.server.example('paper-5.1')).drive, teeth: { count: 28, radius_mm: 4.5, width_mm: 15 } } })).ring.tip_radius_mm);
});

test('page asks for a key, keeps it in memory', async () => {
  const made = execFileSync(BINARY, ['new-key', 'a team'], { encoding: 'utf8' });
  const [key] = made.match(/tw_[0-9a-f]+/);
  const [line] = made.match(/[0-9a-f]{64} a team/);
  const file = join(await mkdtemp(join(tmpdir(), 'keys-')), 'keys');
  await writeFile(file, `${line}\n`);
  const server = await Server.start(undefined, ['--keys-file', file]);
  const context = await bed.browser.newContext({ viewport: { width: 1366, height: 900 } });
  const page = await context.newPage();
  try {
    await page.goto(server.origin);
    await page.waitForSelector('#login:not([hidden])');
    assert.equal(await page.evaluate(() => document.activeElement.id), 'login-key');
    assert.ok(await page.isHidden('#away'));
    await page.fill('#login-key', 'tw_0000');
    await page.keyboard.press('Enter');
    await page.waitForFunction(() => document.querySelector('#login-detail').textContent.includes('does not accept'));
    await page.waitForSelector('#login:not([hidden])');
    await page.fill('#login-key', key);
    await page.keyboard.press('Enter');
    await settled(page);
    assert.ok(await page.isHidden('#login'));
    await enter(page, RADIUS, 4.5);
    assert.match(await page.textContent('#key-figures'), /Largest force\d/);
    // Requests for files have the key too.
    const [download] = await Promise.all([page.waitForEvent('download'), pick(page, '[data-file="ring.dxf"]')]);
    assert.match(download.suggestedFilename(), /ring\.dxf$/);
    const kept = await page.evaluate(() => JSON.stringify([localStorage, sessionStorage, document.cookie, location.href]));
    assert.ok(!kept.includes(key.slice(3)));
    await page.reload();
    await page.waitForSelector('#login:not([hidden])');
  } finally {
    await context.close();
    await server.stop();
  }
});

test('many input angles are thinned in drawing only', async () => {
  const page = await bed.open();
  const design = { ...(await bed.server.example('paper-5.2')), model: { compatibility: 'virtual_work' }, parts: { ring: { clearance_um: 1 } }, sweep: { samples: 4000 } };
  const found = await page.evaluate(async (asked) => {
    const { read } = await import('/page/answers.js');
    const { Motion } = await import('/page/motion.js');
    const { passOf } = await import('/page/pass.js');
    const post = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(asked) })).arrayBuffer();
    const bytes = await post('/v1/sweep');
    const whole = JSON.parse(new TextDecoder().decode(bytes));
    const drawn = read(bytes, 'sweep');
    const geometry = read(await post('/v1/geometry'));
    const key = (states, row) => `${states.input_angle_deg[row]} ${states.tooth[row]} ${states.force_ring_n[row]}`;
    const all = new Set(whole.states.tooth.map((_, row) => key(whole.states, row)));
    const peaks = Object.values(whole.peaks).flatMap(({ force_n: force, stress_mpa: stress }) => [force, stress]).map(({ input_angle_deg: angle }) => angle);
    const counts = new Map();
    whole.states.input_angle_deg.forEach((angle, row) => counts.set(angle, (counts.get(angle) ?? 0) + (whole.states.loaded[row] ? 1 : 0)));
    const jumps = (sweep) => passOf(asked, sweep).breaks.size;
    return {
      all: whole.states.tooth.length,
      drawn: drawn.states.tooth.length,
      areAll: drawn.states.tooth.every((_, row) => all.has(key(drawn.states, row))),
      hasPeaks: peaks.every((angle) => drawn.states.input_angle_deg.includes(angle)),
      carrying: [drawn.loaded_teeth_per_zone.min, drawn.loaded_teeth_per_zone.max],
      wanted: [Math.min(...counts.values()), Math.max(...counts.values())],
      rest: JSON.stringify({ ...drawn, states: undefined }) === JSON.stringify({ ...whole, states: undefined }),
      jumps: [jumps(drawn), jumps(whole)],
      frames: new Motion(asked, geometry, drawn).frames.length,
    };
  }, design);
  assert.ok(found.all > 10_000 && found.drawn < 8000, `${found.drawn} of ${found.all}`);
  assert.ok(found.areAll && found.hasPeaks && found.rest);
  assert.deepEqual(found.carrying, found.wanted);
  assert.ok(found.jumps[0] > 0 && found.frames > 500);
  // A worker reads a large answer, so no task of the page takes as long as reading and drawing it.
  await page.evaluate(() => {
    window.longest = 0;
    new PerformanceObserver((list) => list.getEntries().forEach(({ duration }) => (window.longest = Math.max(window.longest, duration)))).observe({ type: 'longtask' });
  });
  const workers = [];
  page.on('worker', (worker) => workers.push(worker.url()));
  await page.click('summary:has-text("Sweep and profile")');
  await page.fill(field('/sweep/samples'), '6000');
  await page.waitForFunction(() => document.querySelector('#key-figures').getAttribute('aria-busy') === 'false', undefined, { timeout: 60_000 });
  await settled(page);
  assert.deepEqual(workers.map((url) => new URL(url).pathname), ['/page/large.js']);
  const { peaks } = await bed.server.ask('/v1/sweep', { ...(await bed.server.example('paper-5.1')), sweep: { samples: 6000 } });
  assert.equal(await resultOf(page, 'Force, ring'), peaks.ring.force_n.value);
  console.log(`longest task with 6000 samples: ${await page.evaluate(() => window.longest)} ms`);
});

test('page opened at a silent service starts later', async () => {
  const server = await Server.start();
  const page = await open(bed.browser, server);
  page.expectsOutage = true;
  try {
    await page.route('**/v1/examples', (route) => route.abort());
    await page.reload({ waitUntil: 'commit' });
    await page.waitForSelector('#away:not([hidden])');
    await page.unroute('**/v1/examples');
    await page.waitForSelector('#away', { state: 'hidden', timeout: 10_000 });
    await settled(page);
    assert.match(await page.textContent('#key-figures'), /Largest force1549/);
  } finally {
    await page.context().close();
    await server.stop();
  }
});

test('page retries only the documents that failed', async () => {
  const page = await bed.open();
  page.expectsOutage = true;
  let asked = 0;
  // The first requests of a page include some of these.
  await page.route(/\/v1\/(quantities|examples)/, (route) => ((asked += 1) % 4 === 0 ? route.abort() : route.continue()));
  await page.reload();
  await settled(page);
  const examples = await page.locator('[data-example]').count();
  assert.ok(examples > 4);
  // The page repeated exactly the failed requests, once for each failure.
  const { examples: served } = await (await fetch(`${bed.server.origin}/v1/examples`)).json();
  assert.equal(asked - Math.floor(asked / 4), served.length + 2);
});
