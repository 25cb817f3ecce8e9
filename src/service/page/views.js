// What the page is about at the moment: the design, a search for one, or what studies tell of it.

import { html } from './dom.js';
import { t } from './texts.js';
import { Toolbar } from './toolbar.js';

const VIEWS = ['design', 'find', 'explore', 'sensitivity', 'tolerance'];

export class Views {
  #buttons;

  /** `onShow(key, isFromAddress)` when another view is shown. */
  constructor(bar, onShow) {
    this.onShow = onShow;
    this.#buttons = new Map(VIEWS.map((key) => [key, html('button', { type: 'button', 'data-view': key, onclick: () => this.show(key) }, t(`view.${key}`))]));
    bar.append(...this.#buttons.values());
    this.#mark('design');
    new Toolbar(bar);
  }

  #mark(view) {
    document.body.dataset.view = view;
    for (const [key, button] of this.#buttons) button.setAttribute('aria-pressed', String(key === view));
  }

  show(view, isFromAddress = false) {
    if (document.body.dataset.view === view || !this.#buttons.has(view)) return;
    this.#mark(view);
    scrollTo(0, 0);
    this.onShow(view, isFromAddress);
  }

  /** Shows a view from within another one, which goes, and the focus in it. */
  goTo(view) {
    this.show(view);
    this.#buttons.get(view).focus();
  }
}
