// Axes of a drawing in SVG, coloured by the style sheet, so that they follow the theme by themselves.

import { svg } from './dom.js';
import { number } from './format.js';

const TOP = 26;
const RIGHT = 14;
const BOTTOM = 42;
const LEFT = 62;
const LABEL_EDGE = 4;
/** Measures words before they are drawn. */
const pen = document.createElement('canvas').getContext('2d');

/** Round numbers between two: at most so many, but two at least, without which there is no scale. */
export function ticks(min, max, most) {
  for (let count = Math.max(1, most); count < 30; count += 1) {
    const found = roundNumbers(min, max, count);
    const stride = Math.ceil(found.length / (Math.max(2, most) + 1));
    if (found.length >= 2) return found.filter((_, index) => index % stride === 0);
  }
  return [min];
}

function roundNumbers(min, max, most) {
  const raw = (max - min) / most;
  if (!(raw > 0)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= raw * 0.999);
  const found = [];
  for (let index = Math.ceil(min / step - 1e-9); index * step <= max + 1e-9 * step; index += 1) found.push(index * step);
  return found;
}

/** The range of numbers with some room on either side; never empty. */
export function spread(values, room = 0.06) {
  let [min, max] = [Infinity, -Infinity];
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    if (value < min) min = value;
    if (value > max) max = value;
  }
  if (min > max) return { min: 0, max: 1 };
  const size = Math.max(Math.abs(min), Math.abs(max));
  // What differs by rounding alone is one value.
  const half = max - min > 1e-9 * size ? room * (max - min) : 0.05 * (size || 1);
  return { min: min - half, max: max + half };
}

/** The name of an axis around a place, or as near to it as it has room, and narrower where it has none. */
function axisLabel(text, center, y, width) {
  const room = width - 2 * LABEL_EDGE;
  pen.font = `600 12px ${getComputedStyle(document.body).fontFamily}`;
  const length = pen.measureText(text).width;
  const shown = Math.min(length, room);
  const x = Math.min(Math.max(LABEL_EDGE, center - shown / 2), width - LABEL_EDGE - shown);
  return svg('text', { x, y, class: 'axis-label', ...(length > room && { textLength: room, lengthAdjust: 'spacingAndGlyphs' }) }, text);
}

/** Numbers in words, with digits enough that no two of them look alike. */
function apart(values) {
  for (let digits = 5; ; digits += 1) {
    const texts = values.map((value) => number(value, digits, digits - 2));
    if (digits >= 15 || new Set(texts).size === texts.length) return texts;
  }
}

/** Where an axis has a mark: `[{ value, text }]`. */
function marksOf({ min, max }, most) {
  const values = ticks(min, max, most);
  const texts = apart(values);
  return values.map((value, index) => ({ value, text: texts[index] }));
}

/** Empty axes: `{ root, plot, x(value), y(value), box, valueAt(px, py) }`. An axis is `{ min, max, label }`. */
export function axes(width, height, xAxis, yAxis) {
  const [top, bottom] = [TOP, height - BOTTOM];
  const yMarks = marksOf(yAxis, Math.max(2, Math.floor((bottom - top) / 44)));
  pen.font = `12px ${getComputedStyle(document.body).fontFamily}`;
  const left = Math.max(LEFT, 14 + Math.max(...yMarks.map(({ text }) => pen.measureText(text).width)));
  const box = { left, top, right: width - RIGHT, bottom };
  const x = (value) => box.left + ((value - xAxis.min) / (xAxis.max - xAxis.min)) * (box.right - box.left);
  const y = (value) => box.bottom - ((value - yAxis.min) / (yAxis.max - yAxis.min)) * (box.bottom - box.top);
  const grid = svg('g', { class: 'grid' });
  const words = svg('g', { class: 'ticks' });
  for (const { value, text } of marksOf(xAxis, Math.max(2, Math.floor((box.right - box.left) / 64)))) {
    grid.append(svg('line', { x1: x(value), x2: x(value), y1: box.top, y2: box.bottom }));
    words.append(svg('text', { x: x(value), y: box.bottom + 17, 'text-anchor': 'middle' }, text));
  }
  for (const { value, text } of yMarks) {
    grid.append(svg('line', { x1: box.left, x2: box.right, y1: y(value), y2: y(value) }));
    words.append(svg('text', { x: box.left - 7, y: y(value) + 4, 'text-anchor': 'end' }, text));
  }
  words.append(axisLabel(xAxis.label, (box.left + box.right) / 2, height - 6, width), axisLabel(yAxis.label, 0, 15, width));
  const plot = svg('g', {});
  const root = svg('svg', { viewBox: `0 0 ${width} ${height}`, width, height, class: 'chart-svg', 'aria-hidden': 'true' }, grid, plot, words);
  const valueAt = (px, py) => ({
    x: xAxis.min + ((px - box.left) / (box.right - box.left)) * (xAxis.max - xAxis.min),
    y: yAxis.min + ((box.bottom - py) / (box.bottom - box.top)) * (yAxis.max - yAxis.min),
  });
  return { root, plot, grid, x, y, box, valueAt };
}
