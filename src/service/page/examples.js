// Ready designs: those of the service, and the first one, which is an example's drive by the default model.

import { isSame } from './design.js';
import { byId, html, setAttributes } from './dom.js';
import { getJson } from './service.js';
import { SERVICE, t } from './texts.js';

/** The page opens on the drive of this example, and tells what limits its torque if it is of steel. */
const FIRST_DRIVE = 'paper-5.1';
const STEEL_LIMITS = { allowable_stress_mpa: 1500, strength: '42crmo4-qt' };

/** A title without what its colon leads to. */
export const shortTitle = (title) => title.split(/[:\uff1a]/)[0];

export class Examples {
  #all = [];

  /** `onChoose(design, origin)` when one is chosen. */
  constructor(onChoose) {
    this.onChoose = onChoose;
  }

  async load() {
    const { examples } = await getJson('v1/examples');
    const loaded = await Promise.all(examples.map(async ({ name, title, href }) => ({ name, title: SERVICE.examples?.[name] ?? title, design: await getJson(href.slice(1)) })));
    const { drive, load } = (loaded.find(({ name }) => name === FIRST_DRIVE) ?? loaded[0]).design;
    const { allowable_stress_mpa, strength } = STEEL_LIMITS;
    const design = { drive, load: { ...load, allowable_stress_mpa }, parts: { carrier: { strength } }, sweep: { wind_up: true } };
    this.#all = [{ name: 'first', title: t('design.first'), design }, ...loaded];
  }

  get isLoaded() {
    return this.#all.length > 0;
  }

  get first() {
    return this.#all[0];
  }

  /** The one that a design is, undefined where it is none of them. */
  find(design) {
    return this.#all.find((candidate) => isSame(candidate.design, design));
  }

  originOf = ({ title, design }) => ({ title: shortTitle(title), design });

  offer() {
    for (const example of this.#all) {
      example.button = html('button', { type: 'button', 'data-example': example.name, onclick: () => this.onChoose(example.design, this.originOf(example)) }, example.title);
      byId('examples').append(example.button);
    }
  }

  mark(design) {
    for (const example of this.#all) if (example.button) setAttributes(example.button, { 'aria-pressed': isSame(example.design, design) });
  }
}
