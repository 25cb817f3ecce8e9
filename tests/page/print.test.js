// Printing.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { createCanvas } from '@napi-rs/canvas';
import { getDocument } from 'pdfjs-dist/legacy/build/pdf.mjs';
import { enter, setDocument, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });

/** The lines of each page from top to bottom; ligatures stand alone in a PDF. */
async function printed(page) {
  const data = new Uint8Array(await page.pdf({ preferCSSPageSize: true, printBackground: true }));
  const pdf = await getDocument({ data, verbosity: 0 }).promise;
  const pages = [];
  for (let number = 1; number <= pdf.numPages; number += 1) {
    const { items } = await (await pdf.getPage(number)).getTextContent();
    const lines = new Map();
    for (const { str, transform } of items) {
      if (!str.trim()) continue;
      const y = Math.round(transform[5] / 3);
      lines.set(y, [...(lines.get(y) ?? []), { x: transform[4], str }]);
    }
    pages.push([...lines].sort(([one], [other]) => other - one).map(([, parts]) => parts.sort((one, other) => one.x - other.x).map(({ str }) => str).join(' ').replace(/ ?(ff|fi|fl) ?/g, '$1')));
  }
  return pages;
}

/** Coloured pixels of a rendered page within a box in points, x to the right and y down from the upper left. */
async function colouredPixels(pdfPage, { x, y, width, height }) {
  const viewport = pdfPage.getViewport({ scale: 1 });
  const canvas = createCanvas(viewport.width, viewport.height);
  const canvasContext = canvas.getContext('2d');
  await pdfPage.render({ canvasContext, viewport }).promise;
  const { data } = canvasContext.getImageData(x, y, width, height);
  let count = 0;
  for (let at = 0; at < data.length; at += 4) if (Math.max(...data.subarray(at, at + 3)) - Math.min(...data.subarray(at, at + 3)) > 60) count += 1;
  return count;
}

test('plots are printed', async () => {
  const page = await bed.open();
  for (const design of [await bed.server.example('paper-5.1'), await bed.server.example('paper-5.2')]) {
    await setDocument(page, design);
    const data = new Uint8Array(await page.pdf({ preferCSSPageSize: true, printBackground: true }));
    const first = await (await getDocument({ data, verbosity: 0 }).promise).getPage(1);
    const { items } = await first.getTextContent();
    const [, , , top] = first.view;
    for (const caption of ['Normal force, N', 'Contact stress, MPa']) {
      const { transform } = items.find(({ str }) => str.startsWith(caption));
      // The plot is below its caption and has its width.
      const box = { x: Math.round(transform[4]), y: Math.round(top - transform[5]) + 4, width: 250, height: 130 };
      const count = await colouredPixels(first, box);
      assert.ok(count >= 200, `${caption}: ${count} coloured pixels`);
    }
  }
});

test('impossible design prints inputs and reasons, no old numbers', async () => {
  const page = await bed.open();
  await enter(page, '/drive/wave_generator/semi_minor_mm', 60);
  const pages = await printed(page);
  assert.equal(pages.length, 1);
  const text = pages[0].join('\n');
  assert.match(text, /The design is impossible/);
  assert.match(text, /Semi-major axis: .*must exceed/);
  assert.match(text, /Semi-minor axis\s+60/);
  assert.doesNotMatch(text, /1549|Largest stress|980/);
  // A possible design prints everything again.
  await enter(page, '/drive/wave_generator/semi_minor_mm', 56);
  assert.match((await printed(page)).flat().join('\n'), /1549/);
});

test('no heading is alone at a page’s foot', async () => {
  const page = await bed.open();
  const heads = await page.evaluate(() => [...document.querySelectorAll('h2, h3, .group th')].map((element) => element.childNodes[0]?.textContent.trim()).filter(Boolean));
  assert.ok(heads.includes('Results') && heads.includes('Sizes and clearances'));
  const base = await bed.server.example('paper-5.2');
  for (const design of [
    await bed.server.example('paper-5.1'),
    base,
    { ...base, sweep: { wind_up: true } },
    { ...base, sweep: { wind_up: true }, load: { ...base.load, allowable_stress_mpa: 1500 }, model: { compatibility: 'virtual_work' }, parts: { ring: { clearance_um: 2 } } },
  ]) {
    await setDocument(page, design);
    const pages = await printed(page);
    assert.ok(pages.length <= 2, `${pages.length} pages`);
    for (const lines of pages) assert.ok(!heads.includes(lines.at(-1)?.trim()), `${lines.at(-1)} stands alone`);
  }
});

test('comparison prints the inputs that differ', async () => {
  const page = await bed.open();
  await page.click('#keep');
  await enter(page, '/load/input_torque_nm', 3);
  const text = (await printed(page)).flat().join('\n');
  assert.match(text, /Inputs that differ ?from the reference/);
  assert.match(text, /Input torque\s+3.N·m\s+20.N·m/);
});

test('report names findings, load, assumption and symbols on page one', async () => {
  const page = await bed.open({ example: null });
  await enter(page, '/load/input_torque_nm', 60);
  const pages = await printed(page);
  assert.equal(pages.length, 2);
  const first = pages[0].join('\n');
  for (const wanted of [/At 60.N·m input torque \(840/, /Stress above the/, /far ends joined/, /ψ: position/, /http:\/\/127/, /1 \/ 2/]) assert.match(first, wanted);
  // The enlarged tooth is the most loaded one, whatever is selected.
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  const loads = await page.textContent('#tooth-state');
  assert.ok(Number(/up to (\d+)/.exec(loads)[1]) > 1500, loads);
});

test('reference of the same name is told apart', async () => {
  const page = await bed.open({ example: null });
  await enter(page, '/load/input_torque_nm', 25);
  await page.click('#keep');
  await enter(page, '/load/input_torque_nm', 30);
  const pages = await printed(page);
  assert.equal(pages.length, 2);
  assert.match(pages[0].join('\n'), /compared with the reference First design \(changed\), with input torque\s+25.N·m/);
});
