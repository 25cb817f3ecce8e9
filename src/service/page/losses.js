// What a turn costs on each kind of wave generator, side by side: the design at hand, asked about with each.

import { USUAL_FRICTION, at, bearingRadiusOf, changed, isSame } from './design.js';
import { html, setText } from './dom.js';
import { number, withUnit } from './format.js';
import { ask } from './service.js';
import { labelled, t } from './texts.js';

const KINDS = ['plain', 'race', 'rolling'].map((kind) => ({ kind, name: t(`losses.${kind}`) }));
const PLACES = ['wave_generator', 'ring', 'carrier', 'bearing'];

/** The friction of a design on one kind of wave generator: its own numbers, and where it has none the usual. */
function frictionOn(kind, design) {
  const { wave_generator: own = {}, ...others } = design.friction ?? {};
  const elsewhere = (part) => others[part] ?? { coefficient: USUAL_FRICTION.coefficient };
  const bearing = {
    bearing_coefficient: own.bearing_coefficient ?? USUAL_FRICTION.bearing,
    bearing_radius_mm: own.bearing_radius_mm ?? bearingRadiusOf(design),
    ...(own.bearing_load_rating_n === undefined ? {} : { bearing_load_rating_n: own.bearing_load_rating_n, bearing_element: own.bearing_element ?? 'ball' }),
  };
  const rubbing = { coefficient: own.coefficient ?? USUAL_FRICTION.coefficient };
  const wave = { plain: rubbing, race: { ...rubbing, ...bearing }, rolling: bearing }[kind];
  return { ...others, wave_generator: { kind, ...wave }, ring: elsewhere('ring'), carrier: elsewhere('carrier') };
}

const on = (kind, design) => changed(design, '/friction', frictionOn(kind, design));

/** What of a design the comparison depends on. */
const questionOf = (design) =>
  KINDS.map(({ kind }) => {
    const { drive, materials, parts, load, model, modification, deviations, sweep, friction } = on(kind, design);
    return { drive, materials, parts, load, model, modification, deviations, sweep, friction };
  });

const percent = (share) => withUnit(number(100 * share, 3), '%');

/** In words, what the numbers rest on. */
function assumed(design) {
  const { wave_generator: race, ring, carrier } = frictionOn('race', design);
  const coefficients = { wave_generator: race.coefficient, ring: ring.coefficient, carrier: carrier.coefficient, bearing: race.bearing_coefficient, radius: number(race.bearing_radius_mm, 4) };
  return design.friction ? t('losses.with_own', coefficients) : t('losses.with_usual', coefficients);
}

export class Losses {
  #design;
  #compared;
  #message = '';
  #running;

  /** `onApply(design)` when a kind is chosen. */
  constructor({ panel, compare, state, table }, onApply) {
    Object.assign(this, { panel, button: compare, state, table, onApply });
    compare.addEventListener('click', () => this.compare());
  }

  setDesign(design) {
    this.#design = design;
    this.#message = '';
    this.#show();
  }

  async compare() {
    this.#running?.abort();
    const running = new AbortController();
    this.#running = running;
    const design = this.#design;
    this.#message = t('losses.comparing');
    this.#show();
    try {
      const replies = await Promise.all(KINDS.map(({ kind }) => ask('v1/sweep', on(kind, design), { signal: running.signal })));
      const refused = replies.find(({ problem }) => problem)?.problem;
      this.#message = refused ? labelled(refused.title, refused.detail) : '';
      if (!refused) this.#build(design, replies.map(({ answer }) => answer.losses));
    } catch (error) {
      if (running.signal.aborted) return;
      this.#message = error.message;
    }
    this.#running = undefined;
    this.#show();
  }

  #build(design, losses) {
    this.#compared = { design, asked: questionOf(design) };
    const hasPower = losses[0].power_loss_w !== undefined;
    const heads = [t('part.wave_generator'), t('losses.efficiency'), t('losses.back_driven'), hasPower ? t('losses.power') : undefined, ...PLACES.map((place) => t(`losses.at.${place}`))];
    const rows = KINDS.map(({ kind, name }, index) => {
      const { efficiency, self_locking: locks, loss_ratio: ratio, loss_ratio_by_place: places, power_loss_w: power } = losses[index];
      const button = html('button', { type: 'button', 'aria-label': t('losses.use', { name }) }, name);
      const cells = [
        html('data', { class: 'number', value: efficiency.ring_fixed }, percent(efficiency.ring_fixed)),
        locks ? t('result.locks') : html('data', { class: 'number', value: efficiency.ring_fixed_back_driven }, percent(efficiency.ring_fixed_back_driven)),
        hasPower ? html('data', { class: 'number', value: power }, withUnit(number(power, 3), 'W')) : undefined,
        ...PLACES.map((key) => html('data', { class: 'number', value: places[key] }, percent((places[key] / ratio) * (1 - efficiency.ring_fixed)))),
      ];
      const row = html('tr', { 'data-kind': kind }, html('th', { scope: 'row' }, button), cells.filter((cell) => cell !== undefined).map((cell) => html('td', { class: 'numeric' }, cell)));
      row.addEventListener('click', () => this.onApply(on(kind, this.#design)));
      return row;
    });
    const head = heads.filter((text) => text !== undefined).map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text));
    this.table.replaceChildren(html('caption', {}, assumed(design)), html('thead', {}, html('tr', {}, head)), html('tbody', {}, rows));
  }

  #show() {
    const isStale = this.#compared !== undefined && !isSame(this.#compared.asked, questionOf(this.#design));
    this.panel.classList.toggle('outdated', isStale);
    setText(this.button, this.#compared ? t('losses.compare_again') : t('losses.compare'));
    const own = at(this.#design, '/friction/wave_generator/kind');
    for (const row of this.table.querySelectorAll('tbody tr')) row.querySelector('button').setAttribute('aria-pressed', String(row.dataset.kind === own));
    setText(this.state, this.#message || (isStale ? t('losses.stale') : ''));
  }
}
