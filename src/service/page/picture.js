// A drive as a still picture: whole, to scale, its lobes where they stand at the input angle 0.

import { isSame } from './design.js';
import { html, svg } from './dom.js';
import { Body, outlinesOf } from './mechanism.js';
import { Motion } from './motion.js';
import { ask } from './service.js';

/** Outlines of a small picture are true to this share of its radius. */
const FINEST = 1500;
/** Answers that are kept, so that a drive in two places is asked for once. */
const MOST_KEPT = 300;

const kept = [];

/** The geometry of a design, undefined where it has none. */
async function geometryOf(design) {
  const known = kept.find((entry) => isSame(entry.design, design));
  if (known) return known.geometry;
  const geometry = ask('v1/geometry', { ...design, profile: { chord_tolerance_mm: 0.02, extent: 'tooth' } }).then(
    ({ answer }) => answer,
    () => undefined,
  );
  kept.push({ design, geometry });
  if (kept.length > MOST_KEPT) kept.shift();
  return geometry;
}

/** The picture as soon as it comes; `halfMm` is what is seen on either side of the axis, by default all of the drive. */
function draw(container, design, geometry, halfMm) {
  const motion = new Motion(design, geometry);
  const { outer, stride, outlines } = outlinesOf(motion, FINEST);
  const body = new Body();
  body.shape({ ...outlines, zones: '' });
  body.place(motion, 0, { teeth: [], mostForce: 1, mostStress: 1 }, { selected: -1, first: 0, stride, turns: { ring: 0, carrier: 0 }, arrows: { longest: 1, head: 1 } });
  const half = halfMm ?? outer * 1.02;
  container.replaceChildren(svg('svg', { viewBox: `${-half} ${-half} ${2 * half} ${2 * half}`, 'aria-hidden': 'true' }, svg('g', { transform: 'scale(1 -1)' }, body.world)));
}

/** Pictures wait until they are seen, and then for each other: a long list asks for those in sight alone. */
const waiting = new Map();
let isDrawing = false;

async function drawWaiting() {
  if (isDrawing) return;
  isDrawing = true;
  for (const [container, { design, halfMm }] of waiting) {
    waiting.delete(container);
    const geometry = container.isConnected ? await geometryOf(design) : undefined;
    if (geometry) draw(container, design, geometry, halfMm);
  }
  isDrawing = false;
  if (waiting.size > 0) drawWaiting();
}

const wanted = new WeakMap();
const observer = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    observer.unobserve(target);
    waiting.set(target, wanted.get(target));
  }
  drawWaiting();
});

/** An element that a design's picture comes into when it is seen. */
export function picture(design, { halfMm, isLarge = false } = {}) {
  const element = html('span', { class: isLarge ? 'drive-picture large' : 'drive-picture', 'aria-hidden': 'true' });
  wanted.set(element, { design, halfMm });
  observer.observe(element);
  return element;
}
