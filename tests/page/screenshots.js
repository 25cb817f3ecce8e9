// The pictures in docs/screenshots: the first drive with its ring cut too deep, a tooth radius that undercuts, a search and a map.
// Of all of them, or of those that are named: tests/page/run screenshots [NAME...]

import { mkdir } from 'node:fs/promises';
import { Server, choose, enter, launch, notes, open, settled } from './harness.js';

const FOLDER = new URL('../../docs/screenshots/', import.meta.url).pathname;
const WIDE = { viewport: { width: 1366, height: 1120 } };

/** A study may take minutes on a machine that has much else to do. */
const PATIENCE = { timeout: 900_000 };

await mkdir(FOLDER, { recursive: true });
const server = await Server.start();
const browser = await launch();

/** Turns the drive to the ring's largest stress, where undercut and trimmed tips show. */
async function showPeak(page) {
  await page.locator('#table tr', { hasText: 'Contact stress, ring' }).locator('button').click();
  await page.evaluate(() => document.activeElement.blur());
  await settled(page);
}

const wanted = process.argv.slice(2);

async function take(name, options, prepare) {
  if (wanted.length > 0 && !wanted.includes(name)) return;
  const page = await open(browser, server, options);
  await prepare(page);
  await page.screenshot({ path: `${FOLDER}${name}.png` });
  await page.context().close();
}

await take('first-drive', { viewport: { ...WIDE.viewport, height: 1000 }, example: null }, async (page) => {
  await page.click('#intro-hide');
  await page.click('#keep');
  await enter(page, '/parts/ring/clearance_um', 10);
  await showPeak(page);
  await page.evaluate(() => {
    scrollTo(0, 0);
    document.querySelector('#form').scrollTop += 450;
  });
});

await take('undercut', { viewport: { ...WIDE.viewport, height: 1000 }, example: null }, async (page) => {
  await page.click('#keep');
  await enter(page, '/drive/teeth/radius_mm', 7);
  await page.locator(`${notes('/drive/teeth/radius_mm')} .finding`, { hasText: 'Undercut' }).click();
  await showPeak(page);
  await page.evaluate(() => scrollTo(0, 0));
});

await take('find-a-drive', { viewport: { width: 1366, height: 1000 } }, async (page) => {
  await page.click('#views [data-view="find"]');
  await page.selectOption('#field-find-effort', 'quick');
  await page.click('.find button[type=submit]');
  await page.waitForFunction(() => document.querySelector('#find .study-progress').hidden && document.querySelector('#find .headline')?.textContent, undefined, PATIENCE);
  await page.locator('#find .drives-scroll tbody button').nth(3).click();
  // Pictures are drawn when they are seen, and the click has scrolled to its row.
  await page.evaluate(() => {
    document.activeElement.blur();
    scrollTo(0, 0);
  });
  await page.waitForFunction(() => document.querySelector('#find .drive-card svg'));
});

await take('explore', { viewport: { width: 1366, height: 1000 }, colorScheme: 'dark' }, async (page) => {
  await choose(page, 'paper-5.1');
  await page.click('#views [data-view="explore"]');
  const rows = page.locator('#explore .ask-row');
  await rows.nth(2).locator('select').selectOption('/drive/wave_generator/semi_major_mm');
  await rows.nth(0).locator('select').nth(1).selectOption('fine');
  await page.click('#explore button:has-text("Calculate")');
  await page.waitForFunction(() => document.querySelector('#explore .study-progress').hidden && document.querySelector('#explore .heat'), undefined, PATIENCE);
});

await browser.close();
await server.stop();
