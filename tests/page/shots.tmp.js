import { Server, launch, open, settled, pick } from './harness.js';
const server = await Server.start(undefined, [], '/tmp/pg/toothwave');
const browser = await launch();
for (const [w, h] of [[1440, 1000], [768, 1024], [390, 844]]) {
  const page = await open(browser, server, { locale: process.argv[2] ?? 'zh-CN', example: null, viewport: { width: w, height: h } });
  await page.screenshot({ path: `/tmp/pg/s-${w}.png` });
  await page.screenshot({ path: `/tmp/pg/full-${w}.png`, fullPage: true });
  console.log(w, await page.evaluate(() => document.documentElement.scrollWidth));
  await page.context().close();
}
await browser.close(); await server.stop();
