// The findings as a list, each with its explanation.

import { html, setChildren, setText } from './dom.js';
import { explanation, titleOf } from './findings.js';
import { t } from './texts.js';

export class FindingsList {
  #notes = new Map();
  #none = html('p', { class: 'none' });

  /** `labelOf(pointer)`, `goTo(pointer)` and `remedyButton(finding)` as of the form. */
  constructor(container, { labelOf, goTo, remedyButton }) {
    Object.assign(this, { container, labelOf, goTo, remedyButton });
  }

  /** `assumptions` are sentences that hold beside the findings. */
  show(findings, hasReasons, assumptions) {
    const text = findings.length > 0 || assumptions.length > 0 ? assumptions.join(' ') : t('findings.none');
    setText(this.#none, hasReasons ? t('findings.reasons_first') : text);
    setChildren(this.container, [...findings.map((finding) => this.#noteOf(finding)), this.#none]);
  }

  /** A note stays, opened or not, while the numbers of its finding change. */
  #noteOf(finding) {
    const text = JSON.stringify(finding);
    if (!this.#notes.has(finding.key)) this.#notes.set(finding.key, { element: html('details', {}, html('summary', {}, titleOf(finding))), parts: [] });
    const note = this.#notes.get(finding.key);
    if (note.text === text) return note.element;
    note.text = text;
    note.element.className = `note ${finding.severity}`;
    note.parts.forEach((part) => part.remove());
    note.parts = [explanation(finding, this.labelOf, this.goTo), this.remedyButton(finding)].filter(Boolean);
    note.element.append(...note.parts);
    return note.element;
  }
}
