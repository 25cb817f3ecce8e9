// How wrong and how slow each choice of model and input angles is, as the service measures it for the design at hand.

import { at, changed, compatibilityOf, isSame, lawOf } from './design.js';
import { html, setAttributes, setProperties, setText } from './dom.js';
import { kindName } from './field.js';
import { fixed, number } from './format.js';
import { ask } from './service.js';
import { labelled, t } from './texts.js';
import { titleOfCode } from './words.js';

const WANTED = '/accuracy/requested_error';
const WANTED_ERRORS = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];
const WANTED_PRESET = 1e-6;

const modelName = ({ compatibility, law }) => t('accuracy.model', { compatibility: t(`term.${compatibility}.title`), law: kindName('/model/stiffness', law).split(/[,，]/)[0] });
const pointsName = ({ samples, tolerance }) => (samples === undefined ? t('summary.tolerance', { tolerance: number(tolerance, 1) }) : t('summary.samples', { count: samples }));

/** What of a design the measurement depends on. */
const questionOf = ({ drive, materials, parts, load, model, modification, deviations, accuracy }) => ({ drive, materials, parts, load, model, modification, deviations, accuracy });

/** The choice that a design makes. */
function choiceOf(design) {
  const tolerance = at(design, '/sweep/tolerance');
  return {
    compatibility: compatibilityOf(design),
    law: lawOf(design),
    samples: tolerance === undefined ? (at(design, '/sweep/samples') ?? 50) : undefined,
    tolerance,
  };
}

const isSameModel = (one, other) => one.compatibility === other.compatibility && one.law === other.law;
const isSameWay = (one, other) => isSameModel(one, other) && one.samples === other.samples && one.tolerance === other.tolerance;

/** The design with another choice; what a law has of its own is what was measured. */
function applied(way, design, measured) {
  let next = design;
  const own = choiceOf(design);
  if (way.compatibility !== own.compatibility) next = changed(next, '/model/compatibility', way.compatibility);
  const given = way.law === lawOf(measured) ? measured.model?.stiffness : undefined;
  if (way.law !== own.law || (given && !isSame(given, design.model?.stiffness))) next = changed(next, '/model/stiffness', given ?? { law: way.law });
  const { samples, tolerance, ...others } = design.sweep ?? {};
  const points = way.tolerance === undefined ? { samples: way.samples } : { tolerance: way.tolerance };
  return changed(next, '/sweep', { ...points, ...others });
}

export class Accuracy {
  #design;
  /** `{ design, answer }` of the last measurement. */
  #measured;
  #message = '';
  #running;
  #rows = [];
  #folded = new Map();

  /** `onApply(design)` when a choice is made. */
  constructor({ panel, measure, wanted, state, list }, onApply) {
    Object.assign(this, { panel, button: measure, wanted, state, list, onApply });
    measure.addEventListener('click', () => this.measure());
    wanted.addEventListener('change', () => {
      onApply(changed(this.#design, WANTED, Number(wanted.value)));
      if (this.#measured) this.measure();
    });
  }

  setDesign(design) {
    this.#design = design;
    const value = at(design, WANTED) ?? WANTED_PRESET;
    const errors = WANTED_ERRORS.includes(value) || typeof value !== 'number' ? WANTED_ERRORS : [value, ...WANTED_ERRORS];
    if (this.wanted.options.length !== errors.length || !errors.includes(Number(this.wanted.value))) {
      this.wanted.replaceChildren(...errors.map((error) => html('option', { value: error }, number(error, 2))));
    }
    setProperties(this.wanted, { value: String(value) });
    this.#message = '';
    this.#show();
  }

  async measure() {
    this.#running?.abort();
    const running = new AbortController();
    this.#running = running;
    const design = this.#design;
    this.#message = t('accuracy.measuring');
    this.#show();
    try {
      const { answer, problem } = await ask('v1/accuracy', design, { signal: running.signal });
      if (answer) {
        this.#measured = { design, answer };
        this.#build();
      }
      this.#message = problem ? labelled(problem.title, problem.detail) : '';
    } catch (error) {
      if (running.signal.aborted) return;
      this.#message = error.message;
    }
    this.#running = undefined;
    this.#show();
  }

  #build() {
    const { design, answer } = this.#measured;
    const own = choiceOf(design);
    const models = new Map();
    for (const way of answer.ways) {
      const name = modelName(way);
      models.set(name, [...(models.get(name) ?? []), way]);
    }
    this.#rows = [];
    const tables = [...models].map(([name, ways]) => {
      const isOwn = isSameModel(ways[0], own);
      const note = isOwn ? t('accuracy.own') : t('accuracy.differs', { percent: fixed(100 * ways[0].model_difference, 2) });
      const details = html('details', { open: this.#folded.get(name) ?? isOwn }, html('summary', {}, name, ' ', html('span', { class: 'summary-note' }, note)), this.#table(name, ways));
      details.addEventListener('toggle', () => this.#folded.set(name, details.open));
      return details;
    });
    const unavailable = answer.unavailable.map((model) => html('p', { class: 'none' }, labelled(modelName(model), t('accuracy.unavailable', { reason: titleOfCode(model.code) }))));
    this.list.replaceChildren(...tables, ...unavailable);
  }

  #table(name, ways) {
    const { cheapest } = this.#measured.answer;
    const head = [t('accuracy.input_angles'), t('accuracy.error'), t('accuracy.time'), t('accuracy.states')].map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text));
    const rows = ways.map((way) => {
      const button = html('button', { type: 'button', 'aria-label': t('accuracy.use', { points: pointsName(way), model: name }) }, pointsName(way));
      const isCheapest = cheapest && isSameWay(way, cheapest);
      const cells = [way.error, way.solve_us, way.states].map((value, index) =>
        html('td', { class: 'numeric' }, html('data', { class: 'number', value }, number(value, index === 2 ? 7 : 2))),
      );
      const row = html('tr', { class: isCheapest && 'cheapest' }, html('th', { scope: 'row' }, button, isCheapest && ` ${t('accuracy.fastest', { error: number(this.#measured.answer.requested_error, 2) })}`), cells);
      row.addEventListener('click', () => this.onApply(applied(way, this.#design, this.#measured.design)));
      this.#rows.push({ way, button });
      return row;
    });
    return html('table', {}, html('thead', {}, html('tr', {}, head)), html('tbody', {}, rows));
  }

  #show() {
    const measured = this.#measured;
    const isStale = measured !== undefined && !isSame(questionOf(measured.design), questionOf(this.#design));
    this.panel.classList.toggle('outdated', isStale);
    setText(this.button, measured ? t('accuracy.measure_again') : t('accuracy.measure'));
    const own = choiceOf(this.#design);
    for (const { way, button } of this.#rows) setAttributes(button, { 'aria-pressed': isSameWay(way, own) });
    setText(this.state, this.#message || (isStale ? t('accuracy.stale') : measured ? this.#summary() : ''));
  }

  #summary() {
    const { requested_error: wanted, cheapest } = this.#measured.answer;
    const error = number(wanted, 2);
    if (!cheapest) return t('accuracy.none', { error });
    const expected = cheapest.expected_model_error;
    const model = expected === undefined ? t('accuracy.not_measured') : t('accuracy.expected', { percent: Math.round(100 * expected) });
    return `${t('accuracy.found', { error, points: pointsName(cheapest), time: number(cheapest.solve_us, 2) })} ${model}`;
  }
}
