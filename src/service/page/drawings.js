// What can be downloaded: drawings, plots and tables, just as the service answers them, and the printed report. They are asked for on demand
// alone: parts that cannot be made concern nothing but their drawings, and a slider that moves needs none.

import { changed, isSame } from './design.js';
import { html, setText } from './dom.js';
import { reasonsOf } from './findings.js';
import { ask } from './service.js';
import { save } from './share.js';
import { labelled, parts, t } from './texts.js';

/** By the ending of the file: what is accepted, and what else is asked. */
const FORMATS = {
  step: { label: 'STEP', accept: 'model/step' },
  dxf: { label: 'DXF', accept: 'image/vnd.dxf' },
  svg: { label: 'SVG', accept: 'image/svg+xml' },
  '3mf': { label: '3MF', accept: 'model/3mf', query: '?preset=printing' },
  stl: { label: 'STL', accept: 'model/stl', query: '?preset=printing' },
  csv: { label: 'CSV', accept: 'text/csv' },
  'comma.csv': { label: 'CSV 1,5', accept: 'text/csv', query: '?decimal=comma' },
};

const DRAWN = ['step', 'dxf', 'svg', '3mf', 'stl'];
const TABLE = ['csv', 'comma.csv'];

const drawing = (part) => ({ part, path: `v1/drawings/${part}`, formats: DRAWN });

const FILES = [
  drawing('assembly'),
  drawing('ring'),
  drawing('wave-generator'),
  drawing('carrier'),
  drawing('tooth'),
  { part: 'plots', path: 'v1/sweep', formats: ['svg'] },
  { part: 'states', path: 'v1/sweep', formats: TABLE },
  { part: 'profiles', path: 'v1/geometry', formats: TABLE },
];

export class Drawings {
  #design;
  #inputDeg = 0;
  #angle = html('span', { class: 'number' });
  /** Of the design at hand, the problem that a file was refused for. */
  #refusal;

  /** `nameOf(ending)` names a file; `onRefusal()` when `problems` changed; `onReport()` for the report; `goTo(pointer)` and `labelOf(pointer)` as of the form. */
  constructor({ list, state }, callbacks) {
    Object.assign(this, callbacks);
    this.state = state;
    for (const file of FILES) list.append(this.#build({ ...file, name: t(`drawing.${file.part}`) }));
    list.append(html('li', {}, html('span', {}, t('drawing.report')), html('span', { class: 'cluster' }, html('button', { type: 'button', id: 'print', onclick: () => this.onReport() }, t('drawing.print')))));
  }

  #build(file) {
    const { part, name, formats } = file;
    const buttons = formats.map((format) => {
      const { label } = FORMATS[format];
      return html('button', { type: 'button', 'data-file': `${part}.${format}`, 'aria-label': labelled(label, name), onclick: () => this.#fetch(file, format) }, label);
    });
    return html('li', {}, html('span', {}, part === 'assembly' ? parts('drawing.at_angle', { name, angle: this.#angle }) : name), html('span', { class: 'cluster' }, buttons));
  }

  /** A refusal stands as long as the design that it is about. */
  setDesign(design) {
    this.#design = design;
    this.#refusal = undefined;
    this.state.replaceChildren();
  }

  /** The assembly is drawn as the mechanism stands. */
  turnTo(inputDeg, shown) {
    this.#inputDeg = inputDeg;
    setText(this.#angle, shown);
  }

  /** What the form can show at its fields. */
  get problems() {
    return this.#refusal?.errors?.length ? [this.#refusal] : [];
  }

  async #fetch({ part, name, path }, format) {
    const { accept, query = '' } = FORMATS[format];
    const design = this.#design;
    const asked = part === 'assembly' ? changed(design, '/assembly/input_angle_deg', this.#inputDeg) : design;
    const file = this.nameOf(`-${part}.${format}`);
    const done = { file, angle: this.#angle.textContent };
    this.state.replaceChildren(t('drawing.drawing', { name: name.toLowerCase() }));
    try {
      const { answer, problem } = await ask(`${path}${query}`, asked, { accept });
      if (problem) this.#refuse(name, problem, design);
      else {
        save(answer, file);
        this.#settle(design, undefined, part === 'assembly' ? t('drawing.done_at_angle', done) : t('drawing.done', done));
      }
    } catch (error) {
      this.#settle(design, undefined, error.message);
    }
  }

  #refuse(name, problem, design) {
    const reasons = reasonsOf([problem]).map(({ pointer, detail }) =>
      html('li', {}, pointer ? html('button', { type: 'button', class: 'link', onclick: () => this.goTo(pointer) }, labelled(this.labelOf(pointer), detail)) : detail),
    );
    this.#settle(design, problem, html('div', { class: 'note problem' }, html('strong', {}, t('drawing.refused', { name, problem: problem.title })), html('ul', {}, reasons)));
  }

  /** The last word about a file; fields are marked only while the design is still the one that was asked about. */
  #settle(design, refusal, ...words) {
    this.state.replaceChildren(...words);
    this.#refusal = isSame(design, this.#design) ? refusal : undefined;
    this.onRefusal();
  }
}
