// Axes of a drawing in SVG, coloured by the style sheet, so that they follow the theme by themselves.

import { svg } from './dom.js';
import { number } from './format.js';

const TOP = 26;
const RIGHT = 14;
const BOTTOM = 42;
const LEFT = 62;

/** Round numbers between two, at most so many. */
export function ticks(min, max, most) {
  const raw = (max - min) / Math.max(1, most);
  if (!(raw > 0)) return [min];
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

/** Empty axes: `{ root, plot, x(value), y(value), box, valueAt(px, py) }`. An axis is `{ min, max, label, labels }`, where `labels` name places
 *  from 0 on instead of numbers. */
export function axes(width, height, xAxis, yAxis) {
  const box = { left: LEFT, top: TOP, right: width - RIGHT, bottom: height - BOTTOM };
  const x = (value) => box.left + ((value - xAxis.min) / (xAxis.max - xAxis.min)) * (box.right - box.left);
  const y = (value) => box.bottom - ((value - yAxis.min) / (yAxis.max - yAxis.min)) * (box.bottom - box.top);
  const grid = svg('g', { class: 'grid' });
  const words = svg('g', { class: 'ticks' });
  const placesOf = ({ min, max, labels }, most) => {
    const stride = labels && Math.ceil(labels.length / most);
    return labels ? labels.map((text, index) => ({ value: index, text })).filter((_, index) => index % stride === 0) : ticks(min, max, most).map((value) => ({ value, text: number(value, 5) }));
  };
  for (const { value, text } of placesOf(xAxis, Math.max(2, Math.floor((box.right - box.left) / 80)))) {
    grid.append(svg('line', { x1: x(value), x2: x(value), y1: box.top, y2: box.bottom }));
    words.append(svg('text', { x: x(value), y: box.bottom + 17, 'text-anchor': 'middle' }, text));
  }
  for (const { value, text } of placesOf(yAxis, Math.max(2, Math.floor((box.bottom - box.top) / 44)))) {
    grid.append(svg('line', { x1: box.left, x2: box.right, y1: y(value), y2: y(value) }));
    words.append(svg('text', { x: box.left - 7, y: y(value) + 4, 'text-anchor': 'end' }, text));
  }
  words.append(
    svg('text', { x: (box.left + box.right) / 2, y: height - 6, 'text-anchor': 'middle', class: 'axis-label' }, xAxis.label),
    svg('text', { x: 4, y: 15, class: 'axis-label' }, yAxis.label),
  );
  const plot = svg('g', {});
  const root = svg('svg', { viewBox: `0 0 ${width} ${height}`, width, height, class: 'chart-svg', 'aria-hidden': 'true' }, grid, plot, words);
  const valueAt = (px, py) => ({
    x: xAxis.min + ((px - box.left) / (box.right - box.left)) * (xAxis.max - xAxis.min),
    y: yAxis.min + ((box.bottom - py) / (box.bottom - box.top)) * (yAxis.max - yAxis.min),
  });
  return { root, plot, grid, x, y, box, valueAt };
}
