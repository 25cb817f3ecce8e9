// What a step of a dragged slider costs, in processor time of the browser's processes: tests/page/run dragging [BINARY...]
// Of the usual build, or of each of those named, in turns. A step is a new tooth radius, 0.4 s after the one before, and its answer shown.

import { basename } from 'node:path';
import { Server, launch, open, settled } from './harness.js';

const ROUNDS = 3;
const STEPS = 30;
const STEP_MS = 400;
const SLIDER = '.field:has(#field-drive-teeth-radius_mm) input[type=range]';

const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];
const share = (address) => `#design=${Buffer.from(JSON.stringify(address)).toString('base64url')}`;

/** Case 5.1, and a drive of 400 teeth. */
const DESIGNS = [
  [28, (design) => design],
  [400, ({ drive, ...rest }) => ({
    ...rest,
    drive: {
      wave_generator: { semi_major_mm: 57.1, semi_minor_mm: 56.9 },
      teeth: { count: 400, radius_mm: 0.4, width_mm: 15 },
      ring: { teeth: 398 },
    },
  })],
];

async function dragged(browser, server, design, isPlaying) {
  const page = await open(browser, server, { address: share(design) });
  const processes = await browser.newBrowserCDPSession();
  /** Seconds of the processor by kind of process. */
  const spent = async () => {
    const { processInfo } = await processes.send('SystemInfo.getProcessInfo');
    return Object.fromEntries(['renderer', 'browser', 'GPU'].map((kind) => [kind, processInfo.filter(({ type }) => type === kind).reduce((sum, { cpuTime }) => sum + cpuTime, 0)]));
  };
  let posts = 0;
  page.on('request', (request) => (posts += request.method() === 'POST' ? 1 : 0));
  if (isPlaying) await page.click('#play');
  const slider = page.locator(SLIDER);
  await slider.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await slider.boundingBox();
  const move = async (step) => {
    await page.mouse.move(x + width / 2 - step, y + height / 2);
    await page.waitForTimeout(STEP_MS);
  };
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  // The first steps compile what the others run.
  for (let step = 1; step <= 5; step += 1) await move(step);
  posts = 0;
  const before = await spent();
  for (let step = 6; step <= 5 + STEPS; step += 1) await move(step);
  const after = await spent();
  const cost = Object.fromEntries(Object.keys(before).map((kind) => [kind, (1e3 * (after[kind] - before[kind])) / STEPS]));
  cost.posts = posts / STEPS;
  await page.mouse.up();
  if (isPlaying) await page.click('#play');
  await settled(page);
  if (page.faults.length > 0) throw new Error(page.faults.join('\n'));
  await page.context().close();
  return cost;
}

const binaries = process.argv.slice(2);
if (binaries.length === 0) binaries.push(undefined);
const servers = await Promise.all(binaries.map((binary) => Server.start(undefined, [], binary)));
const browser = await launch();
console.log('| program | teeth | playing | page, ms | browser, ms | drawing of both, ms | requests |\n|---|---:|---|---:|---:|---:|---:|');
for (const [teeth, change] of DESIGNS) {
  const design = change(await servers[0].example('paper-5.1'));
  for (const isPlaying of [false, true]) {
    const costs = binaries.map(() => []);
    for (let round = 0; round < ROUNDS; round += 1) {
      for (const [index, server] of servers.entries()) costs[index].push(await dragged(browser, server, design, isPlaying));
    }
    for (const [index, binary] of binaries.entries()) {
      const of = (kind) => median(costs[index].map((cost) => cost[kind])).toFixed(kind === 'posts' ? 1 : 0);
      console.log(`| ${basename(binary ?? 'toothwave')} | ${teeth} | ${isPlaying ? 'yes' : 'no'} | ${['renderer', 'browser', 'GPU', 'posts'].map(of).join(' | ')} |`);
    }
  }
}
await browser.close();
await Promise.all(servers.map((server) => server.stop()));
