// Tests run the real binary and a real Chromium.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createServer } from 'node:net';
import { chromium } from 'playwright-core';

export const BINARY = process.env.TOOTHWAVE_BIN ?? '../../target/debug/toothwave';
const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
/** Where it is given the page's files come from this folder, and the binary need not be built anew for each change of them. */
const PAGE_FOLDER = process.env.PAGE_FOLDER;

async function freePort() {
  const probe = createServer().listen(0, '127.0.0.1');
  await once(probe, 'listening');
  const { port } = probe.address();
  probe.close();
  return port;
}

export class Server {
  static async start(port, settings = [], binary = BINARY) {
    const server = new Server();
    server.port = port ?? (await freePort());
    server.origin = `http://127.0.0.1:${server.port}`;
    server.process = spawn(binary, ['serve', '--listen', `127.0.0.1:${server.port}`, '--log', 'warn', ...settings], { stdio: 'ignore' });
    for (let attempt = 0; ; attempt += 1) {
      try {
        await fetch(`${server.origin}/health/ready`);
        return server;
      } catch (error) {
        if (attempt > 100) throw error;
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
    }
  }

  async stop() {
    this.process.kill('SIGKILL');
    if (this.process.exitCode === null && this.process.signalCode === null) await once(this.process, 'exit');
  }

  async ask(path, design) {
    const response = await fetch(this.origin + path, {
      method: 'POST',
      headers: { 'content-type': 'application/json' },
      body: JSON.stringify(design),
    });
    return response.json();
  }

  /** A file as the API answers it. */
  async file(path, design, accept) {
    const response = await fetch(this.origin + path, {
      method: 'POST',
      headers: { 'content-type': 'application/json', accept },
      body: JSON.stringify(design),
    });
    return Buffer.from(await response.arrayBuffer());
  }

  async answers(design) {
    const [geometry, coincidence, sweep] = await Promise.all(
      ['/v1/geometry', '/v1/coincidence-degree', '/v1/sweep'].map((path) => this.ask(path, design)),
    );
    return { geometry, coincidence, sweep };
  }

  async example(name) {
    return (await fetch(`${this.origin}/v1/examples/${name}`)).json();
  }
}

export const launch = () =>
  chromium.launch({
    executablePath: CHROMIUM,
    headless: true,
    args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--disable-background-networking', '--no-first-run', '--disable-component-update', '--disable-sync'],
  });

/** One server and one browser for the tests of a file, and a page for each: `bed.page` is set by the test with `bed.open(…)`, and must
 *  have had no fault at its end. */
export function testBed({ before, after, afterEach }, settings = []) {
  const bed = {
    async open(options) {
      bed.page = await open(bed.browser, bed.server, options);
      return bed.page;
    },
  };
  before(async () => {
    bed.server = await Server.start(undefined, settings);
    bed.browser = await launch();
  });
  after(async () => {
    await bed.browser?.close();
    await bed.server?.stop();
  });
  afterEach(async () => {
    const faults = bed.page?.faults ?? [];
    await bed.page?.context().close();
    bed.page = undefined;
    assert.deepEqual(faults, [], 'no console error, no violation of the policy, no request to elsewhere');
  });
  return bed;
}

/** What the page opens on: the drive of an example, with limits of steel. */
export const firstDesign = ({ drive, load }) => ({ drive, load: { ...load, allowable_stress_mpa: 1500 }, parts: { carrier: { strength: '42crmo4-qt' } }, sweep: { wind_up: true } });

/** A page that remembers what must not happen: errors, violations of its policy, requests to elsewhere. */
/** It opens on a link to an example, or, with `example: null`, as a new user meets it. */
export async function open(browser, server, { address, example = 'paper-5.1', hasClock = false, ...options } = {}) {
  const context = await browser.newContext({
    viewport: { width: 1366, height: 900 },
    colorScheme: 'light',
    reducedMotion: 'reduce',
    ...options,
  });
  const page = await context.newPage();
  // A busy machine needs longer.
  context.setDefaultTimeout(120_000);
  page.faults = [];
  page.expectsOutage = false;
  page.on('pageerror', (error) => page.faults.push(`error: ${error.stack}`));
  page.on('console', (message) => {
    if (!['error', 'warning'].includes(message.type())) return;
    const text = message.text();
    // The browser logs each refused or failed request, and some tests cause refusals.
    if (text.includes('status of 422')) return;
    if (page.expectsOutage && /Failed to load resource: net::ERR_/.test(text)) return;
    page.faults.push(`${message.type()}: ${text}`);
  });
  context.on('request', (request) => {
    const url = request.url();
    if (!url.startsWith(server.origin) && !url.startsWith('blob:') && !url.startsWith('data:')) page.faults.push(`request to ${url}`);
  });
  if (PAGE_FOLDER) await servePageFrom(context, server, PAGE_FOLDER);
  // A clock that the test can move forward.
  if (hasClock) await page.clock.install();
  const link = address ?? (example ? `#design=${Buffer.from(JSON.stringify(await server.example(example))).toString('base64url')}` : '');
  await page.goto(`${server.origin}/${link}`);
  await settled(page);
  return page;
}

async function servePageFrom(context, server, folder) {
  const { headers } = await fetch(server.origin);
  const policy = { 'content-security-policy': headers.get('content-security-policy') };
  await context.route((url) => url.origin === server.origin && /^\/(page\/.*)?$/.test(url.pathname), (route) => {
    const name = new URL(route.request().url()).pathname.replace(/^\/(page\/)?/, '') || 'index.html';
    return route.fulfill({ path: `${folder}/${name}`, headers: { ...policy, 'content-type': TYPES[name.split('.').at(-1)] } });
  });
}

const TYPES = { html: 'text/html; charset=utf-8', js: 'text/javascript; charset=utf-8', css: 'text/css; charset=utf-8', svg: 'image/svg+xml' };

/** Waits until the page shows the answers about the design that stands in its form. */
export async function settled(page) {
  await page.waitForFunction(() => document.querySelector('#key-figures').getAttribute('aria-busy') === 'false', undefined, { timeout: 60_000 });
  // One more frame, for drawings once a frame.
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
}

/** Presses what may stand in a menu, which opens first. */
export async function pick(page, selector) {
  const target = page.locator(selector);
  const menu = await target.evaluate((element) => element.closest('.menu:not(:popover-open)')?.id);
  if (menu) await page.click(`[popovertarget="${menu}"]`);
  await target.click();
}

export async function choose(page, example) {
  await pick(page, `[data-example="${example}"]`);
  await settled(page);
}

export async function enter(page, pointer, value) {
  await page.fill(field(pointer), String(value));
  await settled(page);
}

export const field = (pointer) => `#field${pointer.replaceAll('/', '-')}`;
export const notes = (pointer) => `#notes${pointer.replaceAll('/', '-')}`;

/** Puts a document into the page as JSON. */
export async function setDocument(page, design) {
  await pick(page, '#open-document');
  await page.fill('#document-text', JSON.stringify(design));
  await page.click('#document-apply');
  await settled(page);
}

/** The design in the page, as its JSON. */
export async function designOf(page) {
  await pick(page, '#open-document');
  const design = JSON.parse(await page.inputValue('#document-text'));
  await page.click('#document-close');
  return design;
}

/** The number in the results' row of this label. */
export const resultOf = (page, label) =>
  page.$$eval(
    '#table tbody tr',
    (rows, wanted) => {
      const row = rows.find((candidate) => !candidate.hidden && candidate.querySelector('th').textContent.startsWith(wanted));
      return row && Number(row.querySelector('data').value);
    },
    label,
  );
