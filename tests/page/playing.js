// How much of a core the page takes while the mechanism plays: processor time of all the browser's processes over ten seconds.
// tests/page/run playing

import { Server, launch, open } from './harness.js';

const SECONDS = 10;
const server = await Server.start();
const browser = await launch();
const page = await open(browser, server, { viewport: { width: 1440, height: 900 }, example: null, reducedMotion: 'no-preference' });
const session = await browser.newBrowserCDPSession();
const cpuTime = async () => (await session.send('SystemInfo.getProcessInfo')).processInfo.reduce((sum, { cpuTime: seconds }) => sum + seconds, 0);
await page.waitForFunction(() => document.querySelector('#play').textContent === 'Pause');
for (const what of ['playing', 'paused']) {
  const [before, since] = [await cpuTime(), performance.now()];
  await page.waitForTimeout(1000 * SECONDS);
  console.log(`${what}: ${Math.round((100_000 * ((await cpuTime()) - before)) / (performance.now() - since))} % of a core`);
  await page.click('#play');
}
await browser.close();
await server.stop();
