// A view that asks one study about the design at hand, anew whenever something changes, and shows what it comes to.

import { Progress, problemNote } from './ask.js';
import { isSame } from './design.js';
import { html } from './dom.js';
import { number } from './format.js';
import { Run } from './studies.js';
import { t } from './texts.js';

const DELAY_MS = 300;

/** Whoever extends it has `ask()`, which answers `{ question, variants, isSlow, … }` or `{ fault }`, and `take(answer, asked)`; and `offer()`, called
 *  before that, where choices follow from the design. */
export class StudyView {
  design;
  isShown = false;
  #run;
  #timer;
  #asked;

  /** So many variants are looked at whenever something changes; more only when they are asked for. */
  constructor({ mostAtOnce, verb }) {
    this.mostAtOnce = mostAtOnce;
    this.button = html('button', { type: 'button', class: 'primary', onclick: () => this.look() }, verb);
    this.progress = new Progress(() => this.#run?.cancel());
    this.state = html('div', { role: 'status', class: 'study-state' });
  }

  setDesign(design) {
    this.design = design;
    if (this.isShown) this.later();
  }

  show(isShown) {
    this.isShown = isShown;
    if (isShown) this.later(0);
  }

  /** Something has changed. */
  later(delay = DELAY_MS) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.offer?.();
      const { fault, variants, question, isSlow } = this.ask();
      if (fault === undefined && this.#asked && isSame(this.#asked, question)) return;
      if (fault === undefined && variants <= this.mostAtOnce && !isSlow) this.look();
      else {
        this.#run?.giveUp();
        this.progress.hide();
        const asked = { count: number(variants, 9), button: this.button.textContent };
        this.state.replaceChildren(fault ?? (isSlow ? t('study.slow', asked) : t('study.many', asked)));
      }
    }, delay);
  }

  async look() {
    clearTimeout(this.#timer);
    const asked = { ...this.ask(), design: this.design };
    const { fault, question, variants } = asked;
    if (fault !== undefined) {
      this.state.replaceChildren(fault);
      return;
    }
    this.#run?.giveUp();
    const run = new Run();
    this.#run = run;
    this.#asked = question;
    const barTimer = setTimeout(() => this.progress.show(t('study.variants', { count: number(variants, 9) })), DELAY_MS);
    try {
      const { answer, state, problem } = await run.follow(question, ({ lookedAt, variants: all, full }) => {
        if (full) this.progress.show(full);
        else this.progress.show(t('study.looked_at', { count: number(lookedAt, 9), all: number(all, 9) }), lookedAt / all);
      });
      this.state.replaceChildren(...(problem ? [problemNote(problem)] : state === 'cancelled' ? [t('study.cancelled')] : []));
      if (answer) this.take(answer, asked);
      // What broke off may be asked for again.
      if (state !== 'done') this.#asked = undefined;
    } catch (error) {
      if (!run.isGivenUp) throw error;
    } finally {
      clearTimeout(barTimer);
      if (this.#run === run) this.progress.hide();
    }
  }
}
