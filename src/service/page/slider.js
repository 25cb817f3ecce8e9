// The slider of a number's field: it spans a range around the value, and at its ends spans anew.

import { html, setAttributes, setProperties, setText } from './dom.js';
import { number } from './format.js';
import { t } from './texts.js';

const STEPS = 250;

/** Sizes that a slider can span; beyond them no design is possible. */
const SPANNED = { least: 1e-12, most: 1e15 };

/** The power of ten times 1, 2 or 5 next below a size. */
function roundStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [5, 2, 1].map((digit) => digit * power).find((step) => step <= size * 1.0001) ?? power;
}

/** A step of about a hundredth of a value. */
export const niceStep = (value) => roundStep(Math.max(Math.abs(value), SPANNED.least) / 100);

export const rounded = (value, step) => {
  const places = Math.min(100, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return Number((step * Math.round(value / step)).toFixed(places));
};

export class Slider {
  step;

  /** `onInput(value)` while it moves, `onHold()` when it is taken, `onEnd()` when it is let go. */
  constructor(field, { onInput, onHold, onEnd }) {
    this.field = field;
    this.input = html('input', { type: 'range', 'aria-label': t('form.slider', { label: field.label }) });
    this.mark = html('span', { class: 'mark', hidden: true, 'aria-hidden': 'true' });
    this.markText = html('span', { class: 'mark-text' });
    this.track = html('div', { class: 'slider' }, this.input, this.mark);
    this.input.addEventListener('input', () => onInput(rounded(Number(this.input.value), this.step)));
    this.input.addEventListener('pointerdown', onHold);
    this.input.addEventListener('change', () => {
      // At the end of its way the slider makes room beyond.
      const { value, min, max } = this.input;
      if (value === min || value === max) this.#span(Number(value));
      onEnd();
    });
  }

  get elements() {
    return [this.track, this.field.mark ? this.markText : ''];
  }

  #span(value) {
    const half = Math.abs(value) * this.field.slider || 1;
    this.step = roundStep((2 * half) / STEPS);
    const low = Math.max(rounded(value - half, this.step), this.step);
    Object.assign(this.input, { min: low, max: rounded(value + half, this.step), step: this.step, value });
  }

  /** Shows a value, where it has one that can be spanned; `respan` says that it is of another document. */
  show(value, respan) {
    const isGiven = typeof value === 'number' && value >= SPANNED.least && value <= SPANNED.most;
    setProperties(this.track, { hidden: !isGiven });
    if (!isGiven) return;
    const { min, max } = this.input;
    if (respan || this.step === undefined || value < Number(min) || value > Number(max)) this.#span(value);
    else setProperties(this.input, { value: String(value) });
    setAttributes(this.input, { 'aria-valuetext': `${value} ${this.field.unit}` });
  }

  /** Marks a value within the range, and says what it is. */
  showMark({ value, text }) {
    setText(this.markText, value === undefined ? text : `${text} ${number(value, 4)} ${this.field.unit}`);
    const share = (value - Number(this.input.min)) / (Number(this.input.max) - Number(this.input.min));
    setProperties(this.mark, { hidden: !(share >= 0 && share <= 1) });
    this.mark.style.setProperty('--at', share);
  }
}
