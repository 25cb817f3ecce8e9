// What a design is compared with, and the inputs in which it differs.

import { byId, html, setProperties, setText } from './dom.js';
import { listed, t } from './texts.js';

export class Comparison {
  #shown = '[]';

  /** `goTo(pointer)` leads to a field. */
  constructor(goTo) {
    this.goTo = goTo;
  }

  /** `differences` as of `inputDifferences`; `isHeld` says that nothing may move because a slider is held. */
  show(reference, differences, isHeld) {
    setProperties(byId('comparing'), { hidden: !reference });
    if (!isHeld) this.#showInputs(differences);
    if (!reference) return;
    setText(byId('reference-name'), reference.name);
    const list = listed(differences.map(({ label, value, reference: other }) => t('form.changed', { label, before: other, after: value })));
    setText(byId('differing'), differences.length > 0 ? t('comparison.differing', { list }) : t('comparison.same'));
  }

  /** Above the table of results: what the differences in it come from. It stands as long as it is the same: a press that begins on one
   *  of its buttons must end on it. */
  #showInputs(differences) {
    const text = JSON.stringify(differences);
    if (text === this.#shown) return;
    this.#shown = text;
    const head = [t('comparison.input'), t('comparison.this_design'), t('comparison.reference')].map((title, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, title));
    const rows = differences.map(({ pointer, label, value, reference }) =>
      html(
        'tr',
        {},
        html('th', { scope: 'row' }, html('button', { type: 'button', class: 'link', onclick: () => this.goTo(pointer) }, label)),
        html('td', { class: 'numeric number' }, value),
        html('td', { class: 'numeric number' }, reference),
      ),
    );
    const table = [html('caption', {}, t('comparison.caption')), html('thead', {}, html('tr', {}, head)), html('tbody', {}, rows)];
    byId('inputs').replaceChildren(...(differences.length > 0 ? table : []));
  }
}
