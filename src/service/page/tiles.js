// Tiles above the results: the load that they hold at, and what a designer decides by.

import { html, setProperties, setText } from './dom.js';
import { number, withUnit } from './format.js';
import { CONTACTS } from './motion.js';
import { backlashOf, backlashRow, compare, greatest, heldOf, isOverloaded, isOverstressed, least, limitOf, percentRow, row, scopeOf, show, write } from './results.js';
import { term } from './terms.js';
import { t } from './texts.js';

/** The contact that carries the largest of a quantity. */
function largest(field, { sweep }) {
  if (!sweep) return undefined;
  const peaks = CONTACTS.map(({ key, name }) => ({ name, peak: sweep.peaks[key][field] }));
  return peaks.reduce((most, candidate) => (candidate.peak.value > most.peak.value ? candidate : most));
}

const largestRow = (label, field, unit, more) =>
  row(label, '', unit, (answers) => largest(field, answers)?.peak.value, {
    note: (answers) => {
      const { name, peak } = largest(field, answers);
      return t('result.peak_at', { part: name.toLowerCase(), position: number(peak.position_deg, 3) });
    },
    ...more,
  });

/** Tiles in a row at most; rows are about as long as each other. */
const MOST_COLUMNS = 6;

const teethOf = ({ coincidence, sweep }) => sweep?.loaded_teeth_per_zone ?? coincidence?.teeth_in_mesh_per_zone;
const stiffnessOf = (which, { sweep }) => sweep?.wind_up && which(sweep.wind_up.torsional_stiffness_nm_per_rad) / 1000;

const STRESS = largestRow(t('result.largest_stress'), 'stress_mpa', 'MPa', { exceedsLimit: (answers) => CONTACTS.some(({ key }) => isOverstressed(key, answers)) });

const CAPACITY = {
  ...row(t('result.capacity'), '', 'N·m', ({ sweep }) => sweep?.torque_capacity?.output_torque_nm, { significant: 4 }),
  note: (answers) => t('result.capacity_limited', { limit: limitOf(answers) }),
  exceedsLimit: isOverloaded,
  isOptional: true,
};

const TILES = [
  row(t('label./ratio'), '', '', ({ geometry }) => geometry?.transmission_ratio),
  row(t('result.contact_ratio'), '', '', ({ coincidence }) => coincidence?.coincidence_degree, {
    note: ({ coincidence }) => t('result.from_position', { position: number(coincidence.engagement.start_deg, 4) }),
    terms: ['coincidence', 'position'],
  }),
  row(t('result.teeth_in_mesh'), '', '', (answers) => teethOf(answers)?.max, {
    name: ({ sweep }) => (sweep ? t('result.loaded_teeth') : t('result.teeth_in_mesh')),
    text: (answers) => {
      const { min, max } = teethOf(answers);
      return min === max ? `${min}` : t('tolerance.range', { low: min, high: max });
    },
    scoped: true,
  }),
  largestRow(t('result.largest_force'), 'force_n', 'N'),
  STRESS,
  CAPACITY,
  {
    ...row(t('result.finger_safety'), '', '', ({ sweep }) => sweep?.fingers?.safety, { significant: 3 }),
    note: heldOf,
    exceedsLimit: ({ sweep }) => sweep.fingers.safety < 1,
    isOptional: true,
  },
  {
    ...row(t('result.stiffness'), '', 'kN·m/rad', (answers) => stiffnessOf(least, answers), { significant: 4 }),
    note: (answers) => t('result.stiffness_range', { most: number(stiffnessOf(greatest, answers), 4) }),
    isOptional: true,
  },
  {
    ...backlashRow(t('result.backlash'), ({ mean_arcmin: mean }) => mean),
    note: (answers) => t('result.backlash_range', { least: number(backlashOf(answers).smallest_arcmin, 4), most: number(backlashOf(answers).largest_arcmin, 4) }),
    state: (answers) => (backlashOf(answers).smallest_arcmin < -1e-9 ? 'warning' : ''),
    isOptional: true,
  },
  percentRow(t('result.efficiency'), '', ({ efficiency }) => efficiency.ring_fixed, {
    significant: 3,
    note: ({ sweep: { losses } }) => (losses.self_locking ? t('result.ring_fixed_locks') : t('result.ring_fixed', { percent: number(100 * losses.efficiency.ring_fixed_back_driven, 3) })),
    isOptional: true,
  }),
  row(t('result.undercut'), '', '', ({ geometry }) => geometry && Number(geometry.undercut.occurs), {
    text: ({ geometry }) => (geometry.undercut.occurs ? t('result.yes') : t('result.no')),
    note: ({ geometry: { undercut } }) =>
      undercut.critical_tooth_radius_mm === undefined ? t('result.no_radius') : t('result.critical', { radius: number(undercut.critical_tooth_radius_mm, 4) }),
    state: ({ geometry }) => (geometry.undercut.occurs ? 'warning' : 'good'),
  }),
];

/** The load that forces, stresses and safety hold at. */
function loadInWords({ sweep }) {
  if (!sweep) return '';
  const { input_torque_nm: input, output_torque_nm: output } = sweep.load;
  const torques = { input: withUnit(number(input, 5), 'N·m'), output: withUnit(number(output, 5), 'N·m') };
  return sweep.duty ? t('result.at_duty', torques) : t('result.at_load', torques);
}

/** What became of the stress and the torque capacity, in words; '' where neither changed. */
export const effectOn = (before, after) =>
  [STRESS, CAPACITY]
    .map((entry) => ({ entry, values: [before, after].map((answers) => show(entry, answers)?.text) }))
    .filter(({ values: [one, other] }) => one !== other && one && other)
    .map(({ entry: { label, unit }, values: [one, other] }) => t('form.changed', { label, before: one, after: withUnit(other, unit) }));

export class Tiles {
  #tiles = [];

  constructor(loadLine, container) {
    Object.assign(this, { loadLine, container });
    for (const entry of TILES) {
      const value = html('data', { class: 'value number' });
      const unit = entry.unit && !entry.text ? html('span', { class: 'unit' }, entry.unit) : undefined;
      const [delta, note] = ['tile-note delta number', 'tile-note number'].map((name) => html('span', { class: name }));
      const scope = entry.scoped && html('span');
      const name = html('span', {}, entry.label);
      const tile = html('div', { class: 'tile', hidden: Boolean(entry.isOptional) }, html('dt', {}, html('span', {}, name, scope), entry.terms && term(...entry.terms)), html('dd', {}, html('span', { class: 'quantity' }, value, unit && ['\u202f', unit]), delta, note));
      this.#tiles.push({ entry, tile, name, value, delta, note, scope });
      container.append(tile);
    }
  }

  #deltaOf(entry, answers, reference) {
    const difference = reference ? compare(entry, answers, reference) : '';
    return difference === t('result.differs') ? t('result.reference', { value: entry.text(reference) }) : difference;
  }

  /** Shows answers, and their differences from those of a reference. What has no answer keeps its place but no number; `isHeld` says that no
   *  tile may go, because a slider is held. */
  update(answers, reference, isHeld) {
    setText(this.loadLine, loadInWords(answers));
    for (const { entry, tile, name, value, delta, note, scope } of this.#tiles) {
      if (scope) setText(scope, scopeOf(entry, answers));
      if (entry.name) setText(name, entry.name(answers));
      const shown = show(entry, answers);
      // What a design need not ask for takes no room where it does not.
      setProperties(tile, { hidden: Boolean(entry.isOptional) && !shown && (tile.hidden || !isHeld) });
      write(value, shown);
      setText(delta, shown ? this.#deltaOf(entry, answers, reference) : '');
      setText(note, shown ? (entry.note?.(answers) ?? '') : '');
    }
    const count = this.#tiles.filter(({ tile }) => !tile.hidden).length;
    this.container.style.setProperty('--columns', Math.ceil(count / Math.ceil(count / MOST_COLUMNS)));
  }
}
