// The pictures in docs/screenshots: both of the paper's cases in light, dark and narrow, and case 5.1 made to undercut.

import { mkdir } from 'node:fs/promises';
import { Server, choose, enter, launch, notes, open, settled } from './harness.js';

const FOLDER = new URL('../../docs/screenshots/', import.meta.url).pathname;
const WIDE = { viewport: { width: 1366, height: 1120 } };
const NARROW = { viewport: { width: 400, height: 1500 } };

await mkdir(FOLDER, { recursive: true });
const server = await Server.start();
const browser = await launch();

/** Turns the drive to the ring's largest stress, where undercut and trimmed tips show. */
async function showPeak(page) {
  await page.locator('#table tr', { hasText: 'Contact stress, ring' }).locator('button').click();
  await page.evaluate(() => document.activeElement.blur());
  await settled(page);
}

async function take(name, options, prepare) {
  const page = await open(browser, server, options);
  await prepare(page);
  await page.screenshot({ path: `${FOLDER}${name}.png` });
  await page.context().close();
}

for (const example of ['paper-5.1', 'paper-5.2']) {
  const prepare = async (page) => {
    await choose(page, example);
    await showPeak(page);
    await page.evaluate(() => scrollTo(0, 0));
  };
  await take(`${example}-light`, WIDE, prepare);
  await take(`${example}-dark`, { ...WIDE, colorScheme: 'dark' }, prepare);
  await take(`${example}-narrow`, NARROW, async (page) => {
    await prepare(page);
    await page.evaluate(() => document.querySelector('main').scrollIntoView());
  });
}

await take('undercut', { viewport: { ...WIDE.viewport, height: 1000 } }, async (page) => {
  await page.click('#keep');
  await enter(page, '/drive/teeth/radius_mm', 7);
  await page.locator(`${notes('/drive/teeth/radius_mm')} .finding`).first().click();
  await showPeak(page);
  await page.evaluate(() => scrollTo(0, 0));
});

await browser.close();
await server.stop();
