// What a designer decides by, as a table: each row is one entry here. A result that the service does not answer is not shown.

import { at, isEstimated, outerRadiusOf } from './design.js';
import { html, setAttributes, setProperties, setText, symbol } from './dom.js';
import { DASH, difference, number, withUnit } from './format.js';
import { strengthNamed, unpublished } from './materials.js';
import { CONTACTS } from './motion.js';
import { term } from './terms.js';
import { listed, t, textOf } from './texts.js';

export const row = (label, sign, unit, get, more) => ({ label, symbol: sign, unit, get, ...more });

const peakRows = (field, name, sign, unit) =>
  CONTACTS.map(({ key, name: contact, index }) =>
    row(t('result.of', { what: name, part: contact.toLowerCase() }), `${sign}_${index}`, unit, ({ sweep }) => sweep?.peaks[key][field].value, {
      place: ({ sweep }) => sweep.peaks[key][field],
      exceedsLimit: (answers) => field === 'stress_mpa' && isOverstressed(key, answers),
    }),
  );

/** The stress that a design allows at a contact, where it gives one. */
function allowableAt(contact, { design }) {
  const given = at(design, '/load/allowable_stress_mpa');
  return typeof given === 'object' ? given?.[contact] : given;
}

export const isOverstressed = (contact, answers) => answers.sweep.peaks[contact].stress_mpa.value > allowableAt(contact, answers);
export const isOverloaded = ({ sweep: { torque_capacity: capacity, load } }) => Math.abs(capacity.output_torque_nm) < Math.abs(load.output_torque_nm);

/** What goes with the largest stress of each contact. */
const contactRows = (field, name, sign, unit) =>
  CONTACTS.map(({ key, name: contact, index }) =>
    row(t('result.of', { what: name, part: contact.toLowerCase() }), `${sign}_${index}`, unit, ({ sweep }) => sweep?.peaks[key][field]),
  );

export const least = (column) => column?.reduce((most, value) => Math.min(most, value));
export const greatest = (column) => column?.reduce((most, value) => Math.max(most, value));

const percent = (share) => `${share > 0 ? '+' : share < 0 ? '−' : ''}${Math.abs(Math.round(100 * share))}`;
const span = ({ low, high }) => t('result.span', { low: percent(low), high: percent(high) });

/** How far to believe some numbers: what the model was found to err by in drives of this case, calculated as elastic bodies. What is not like
 *  those drives is said once, at the peaks. */
function believed(what, { sweep }, saysWhatIsUnlike) {
  if (!sweep) return '';
  const { measured, beyond } = sweep.model_error;
  if (!measured) return t('error.not_measured');
  const unlike = listed(beyond.map((reason) => textOf(`error.beyond.${reason}`) ?? reason.replaceAll('_', ' ')));
  return saysWhatIsUnlike && beyond.length > 0 ? t('error.measured_beyond', { error: what(measured), unlike }) : t('error.measured', { error: what(measured) });
}

/** What comes on top for how the parts are held. */
function heldAs({ sweep }) {
  const { held } = sweep.model_error;
  if (!held) return '';
  const how = { case: textOf(`error.held.${held.case}`) ?? held.case, estimated: percent(held.estimated_wind_up), earlier: held.wind_up && span(held.wind_up) };
  return ` ${held.wind_up ? t('error.held_as_earlier', how) : t('error.held_as', how)}`;
}

/** Of what friction takes. */
const lossRow = (label, sign, unit, get, more) => row(label, sign, unit, ({ sweep }) => sweep?.losses && get(sweep.losses), more);

export const percentRow = (label, sign, get, more) => lossRow(label, sign, '%', (losses) => { const share = get(losses); return share === undefined ? undefined : 100 * share; }, more);

const PLACES = ['wave_generator', 'ring', 'carrier', 'bearing'];

const lossRows = [
  percentRow(t('losses.efficiency'), 'η', ({ efficiency }) => efficiency.ring_fixed, { significant: 4 }),
  percentRow(t('result.back_driven'), 'η', ({ efficiency }) => efficiency.ring_fixed_back_driven, {
    text: ({ sweep: { losses } }) => (losses.self_locking ? t('result.locks') : `${number(100 * losses.efficiency.ring_fixed_back_driven, 4)} %`),
  }),
  percentRow(t('result.efficiency_error'), '', ({ efficiency_error: error }) => error, { significant: 2 }),
  lossRow(t('result.required_torque'), 'M', 'N·m', ({ required_input_torque_nm: torque }) => torque),
  lossRow(t('result.power_loss'), 'P', 'W', ({ power_loss_w: power }) => power),
  ...PLACES.map((place) => percentRow(t(`result.loss_at.${place}`), '', ({ loss_ratio: whole, loss_ratio_by_place: part }) => (whole > 0 ? part[place] / whole : undefined), { significant: 3 })),
  ...CONTACTS.map(({ key, name, index }) =>
    lossRow(t('result.of', { what: t('plot.rubbing'), part: name.toLowerCase() }), `pv_${index}`, 'MPa m/s', ({ pressure_velocity_mpa_m_per_s: peaks }) => peaks?.[key].value, {
      place: ({ sweep }) => sweep.losses.pressure_velocity_mpa_m_per_s[key],
      significant: 4,
      terms: key === 'wave_generator' ? ['pressure_velocity'] : undefined,
    }),
  ),
  ...CONTACTS.map(({ key, name }) => {
    const wear = (losses) => losses.wear_mm_per_hour?.[key];
    return lossRow(t('result.wear', { part: name.toLowerCase() }), '', '', (losses) => wear(losses) && 1000 * wear(losses).value, {
      significant: 3,
      place: ({ sweep }) => (wear(sweep.losses).position_deg === undefined ? undefined : wear(sweep.losses)),
      terms: key === 'wave_generator' ? ['wear'] : undefined,
    });
  }),
  lossRow(t('result.bearing_load'), 'P', 'N', ({ bearing }) => bearing?.mean_load_n),
  lossRow(t('result.bearing_life'), 'L_10', '', ({ bearing }) => bearing?.life_h, { significant: 3 }),
];

const BACKINGS = ['cam_on_bore', 'housed_rim', 'free_rim', 'finger_at_both_ends', 'finger_at_one_end', 'finger_joined_at_far_end', 'finger_on_web'];

/** What parts behind the contacts are estimated to give way; those of the parts as they are held can be taken over. */
const backingRows = BACKINGS.map((key) => {
  const of = ({ sweep }) => sweep?.series_compliance_estimates?.find(({ backing }) => backing === key);
  const label = t(`result.backing.${key}`);
  return row(label, '', 'mm/N', (answers) => of(answers)?.compliance_mm_per_n, {
    significant: 3,
    name: (answers) => (of(answers).share === undefined ? label : t('result.backing_adds', { label, percent: number(100 * of(answers).share, 2) })),
    taken: (answers) => (of(answers)?.is_as_held && !isEstimated(answers.design) ? of(answers).contact : undefined),
  });
});

export const backlashOf = ({ sweep }) => sweep?.wind_up?.backlash;
export const backlashRow = (label, get) => row(label, '', 'arcmin', (answers) => backlashOf(answers) && get(backlashOf(answers)), { significant: 4 });

const backlashRows = [
  backlashRow(t('result.backlash_mean'), ({ mean_arcmin: mean }) => mean),
  backlashRow(t('result.backlash_least'), ({ smallest_arcmin: smallest }) => smallest),
  backlashRow(t('result.backlash_most'), ({ largest_arcmin: largest }) => largest),
  ...CONTACTS.map(({ key, name }) => backlashRow(t('result.backlash_by', { part: name.toLowerCase() }), ({ contribution_arcmin: part }) => part[key])),
];

/** What limits the torque, and at what number. */
export function limitOf(answers) {
  const { turns_past_teeth: turnsPast, limited_by: limit } = answers.sweep.torque_capacity;
  return turnsPast ? t('result.turns_past') : t(`result.limit.${limit}`, { stress: withUnit(number(allowableAt(limit, answers)), 'MPa') });
}

export function heldOf({ design, sweep: { fingers } }) {
  const holding = t(`result.holding.${fingers.fingers}`);
  return at(design, '/parts/carrier/fingers') ? holding : t('result.assumed', { holding });
}

/** Hardened steel cracks at the notch before it yields. */
function isHardened({ design }) {
  const strength = at(design, '/parts/carrier/strength');
  return (strengthNamed(strength) ?? strength)?.hardened === true;
}

const safetyRow = (label, sign, key, more) => row(label, sign, '', ({ sweep }) => sweep?.fingers?.[key], { significant: 3, exceedsLimit: ({ sweep }) => sweep.fingers[key] < 1, ...more });

export const GROUPS = [
  {
    title: t('result.group.peaks'),
    told: (answers) => believed(({ force, stress }) => t('error.force_and_stress', { force: span(force), stress: span(stress) }), answers, true),
    rows: [...peakRows('force_n', t('result.force'), 'F', 'N'), ...peakRows('stress_mpa', t('plot.stress'), 'σ', 'MPa')],
  },
  {
    title: t('result.group.capacity'),
    told: ({ design, sweep }) => (sweep?.torque_capacity ? [...unpublished(design), sweep.fingers?.safety === undefined && t('result.contacts_only')].filter(Boolean).join(' ') : ''),
    offer: '/load/allowable_stress_mpa',
    rows: [
      row(t('label./load/input_torque_nm'), 'M_0', 'N·m', ({ sweep }) => sweep?.torque_capacity?.input_torque_nm),
      row(t('label./load/output_torque_nm'), 'M_G', 'N·m', ({ sweep }) => sweep?.torque_capacity?.output_torque_nm, { exceedsLimit: isOverloaded }),
      row(t('result.limited_by'), '', '', ({ sweep }) => sweep?.torque_capacity?.limited_by, {
        text: limitOf,
      }),
      row(t('result.capacity_angle'), 'j', 'deg', ({ sweep }) => sweep?.torque_capacity?.input_angle_deg),
    ],
  },
  {
    title: t('result.group.fingers'),
    offer: '/parts/carrier/strength',
    rows: [
      safetyRow(t('result.safety'), 'S', 'safety'),
      safetyRow(t('result.yield_safety'), 'S_F', 'yield_safety', { name: (answers) => (isHardened(answers) ? t('result.yield_safety_hardened') : t('result.yield_safety')) }),
      safetyRow(t('result.fatigue_safety'), 'S_D', 'fatigue_safety'),
      row(t('result.nominal_stress'), 'σ', 'MPa', ({ sweep }) => sweep?.fingers?.nominal_stress_mpa, { significant: 4 }),
      row(t('result.foot_stress'), 'σ', 'MPa', ({ sweep }) => sweep?.fingers?.stress_mpa, { significant: 4 }),
      row(t('result.support'), '', '', ({ sweep }) => sweep?.fingers?.stress_mpa, { text: heldOf }),
      row(t('result.load_along_tooth'), 'κ', '', ({ sweep }) => sweep?.fingers?.load_peak_over_mean, { significant: 3 }),
    ],
  },
  {
    title: t('result.group.wind_up'),
    offer: '/sweep/wind_up',
    told: (answers) => (answers.sweep?.wind_up ? `${believed(({ wind_up: windUp }) => t('error.wind_up', { wind_up: span(windUp) }), answers, false)}${heldAs(answers)}` : ''),
    rows: [
      row(t('result.wind_up_least'), 'Δφ', 'deg', ({ sweep }) => least(sweep?.wind_up?.wind_up_deg)),
      row(t('result.wind_up_most'), 'Δφ', 'deg', ({ sweep }) => greatest(sweep?.wind_up?.wind_up_deg)),
      row(t('result.stiffness_least'), '', '', ({ sweep }) => least(sweep?.wind_up?.torsional_stiffness_nm_per_rad)),
      row(t('result.stiffness_most'), '', '', ({ sweep }) => greatest(sweep?.wind_up?.torsional_stiffness_nm_per_rad)),
      row(t('result.transmission_error'), '', 'deg', ({ sweep }) => sweep?.wind_up?.transmission_error_peak_to_peak_deg),
      ...backlashRows,
    ],
  },
  { title: t('result.group.losses'), offer: '/friction/wave_generator', rows: lossRows },
  {
    title: t('result.group.motion'),
    rows: [
      row(t('label./ratio'), 'i_HG', '', ({ geometry }) => geometry?.transmission_ratio),
      row(t('result.ratio_carrier_fixed'), 'i_HK', '', ({ geometry }) => geometry?.transmission_ratio_carrier_fixed),
      row(t('result.ratio_wave_generator_fixed'), 'i_KG', '', ({ geometry }) => geometry?.members.wave_generator_fixed.ratio),
      row(t('result.torque_ring_fixed'), '', '', ({ geometry }) => geometry?.members.ring_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row(t('result.torque_carrier_fixed'), '', '', ({ geometry }) => geometry?.members.carrier_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row(t('result.torque_wave_generator_fixed'), '', '', ({ geometry }) => geometry?.members.wave_generator_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row(t('result.period'), '', 'deg', ({ geometry }) => geometry?.period_deg),
      row(t('result.contact_ratio_all'), 'ε', '', ({ coincidence }) => coincidence?.coincidence_degree, { significant: 7, terms: ['coincidence'] }),
      row(t('result.mesh_fewest'), '', '', ({ coincidence }) => coincidence?.teeth_in_mesh_per_zone.min, { scoped: true }),
      row(t('result.mesh_most'), '', '', ({ coincidence }) => coincidence?.teeth_in_mesh_per_zone.max, { scoped: true }),
      row(t('result.carrying_fewest'), '', '', ({ sweep }) => sweep?.loaded_teeth_per_zone.min, { scoped: true }),
      row(t('result.carrying_most'), '', '', ({ sweep }) => sweep?.loaded_teeth_per_zone.max, { scoped: true }),
      row(t('result.engagement'), 'ψ_e', 'deg', ({ geometry }) => geometry?.engagement.start_deg, { terms: ['position'] }),
      row(t('result.undercut'), '', '', ({ geometry }) => geometry && Number(geometry.undercut.occurs), {
        text: ({ geometry }) => (geometry.undercut.occurs ? t('result.yes') : t('result.no')),
      }),
      row(t('result.critical_radius'), 'r_c', 'mm', ({ geometry }) => geometry?.undercut.critical_tooth_radius_mm, { significant: 6 }),
    ],
  },
  {
    title: t('result.group.sizes'),
    rows: [
      row(t('quantity.outer_diameter_mm'), '', 'mm', ({ design, geometry }) => geometry && 2 * outerRadiusOf(design, geometry)),
      row(t('result.root_radius'), '', 'mm', ({ geometry }) => geometry?.ring.root_radius_mm),
      row(t('result.tip_radius'), '', 'mm', ({ geometry }) => geometry?.ring.tip_radius_mm),
      row(t('result.tooth_height'), '', 'mm', ({ geometry }) => geometry?.ring.tooth_height_mm),
      row(t('result.pressure_angle_ring'), 'β', 'deg', ({ geometry }) => geometry?.ring.pressure_angle_max_deg),
      row(t('result.pressure_angle_cam'), 'γ', 'deg', ({ geometry }) => geometry?.wave_generator.pressure_angle_max_deg),
      row(t('result.radial_space'), '', 'mm', ({ geometry }) => geometry?.carrier.radial_space_mm),
      row(t('result.slot_wall'), '', 'mm', ({ geometry }) => geometry?.carrier.slot_wall_mm),
      row(t('result.tooth_gap'), '', 'mm', ({ geometry }) => geometry?.teeth.gap_min_mm),
    ],
  },
  {
    title: t('result.group.depth'),
    isMore: true,
    rows: [
      ...contactRows('half_width_mm', t('result.half_width'), 'w', 'mm'),
      ...contactRows('half_length_mm', t('result.half_length'), 'c', 'mm'),
      ...contactRows('shear_stress_mpa', t('result.shear_stress'), 'τ', 'MPa'),
      ...contactRows('shear_depth_mm', t('result.shear_depth'), 'z', 'mm'),
    ],
  },
  {
    title: t('result.group.compliance'),
    isMore: true,
    // To work with, not to report: what was taken over stands in the design.
    isOnScreenAlone: true,
    told: ({ design, sweep }) => (sweep?.series_compliance_estimates?.length > 0 ? t(isEstimated(design) ? 'result.estimated_included' : 'result.estimated') : ''),
    rows: backingRows,
  },
  {
    title: t('result.group.checks'),
    isMore: true,
    rows: [
      row(t('result.torque_balance'), '', '', ({ sweep }) => sweep?.checks.torque_balance_residual, { noDifference: true }),
      row(t('result.period_closure'), '', '', ({ sweep }) => sweep?.checks.period_closure_residual, { noDifference: true }),
    ],
  },
];

/** What a count of teeth is over: where zones are unlike, over all of them. */
export const scopeOf = ({ scoped }, { zones }) => (scoped ? (zones?.areAlike === false ? t('result.all_zones') : t('result.each_zone')) : '');

export function show(entry, answers) {
  const value = entry.get(answers);
  if (value === undefined) return undefined;
  const text = entry.text?.(answers) ?? number(value, entry.significant ?? 5);
  return { value, text, state: entry.exceedsLimit?.(answers) ? 'problem' : (entry.state?.(answers) ?? '') };
}

/** A value in its element; what is beyond its limit is marked. */
export function write(element, shown) {
  setText(element, shown?.text ?? DASH);
  setProperties(element.dataset, { state: shown?.state ?? '' });
  if (shown) setProperties(element, { value: String(shown.value) });
}

export function compare(entry, answers, reference) {
  const value = entry.get(answers);
  const other = entry.get(reference);
  if (value === undefined || other === undefined || entry.noDifference) return '';
  if (!entry.text) return difference(value, other);
  return entry.text(answers) === entry.text(reference) ? '=' : t('result.differs');
}

export class Results {
  #cells = [];
  #offers = [];
  #told = [];

  /** `onShow({ input_angle_deg, position_deg })` when a peak's place is picked, `onAsk(pointer)` when a result is wanted that the
   *  design has to ask for, `onTake(contact, answers)` when an estimate is taken over into the design. */
  constructor({ table, more }, onShow, onAsk, onTake) {
    this.table = table;
    more.addEventListener('click', () => {
      const isAll = table.classList.toggle('all');
      setAttributes(more, { 'aria-expanded': isAll });
      setText(more, isAll ? t('results.less') : t('results.more'));
    });
    const head = html('tr', {}, html('th', { scope: 'col' }, t('result.result')), html('th', { scope: 'col', class: 'numeric' }, t('comparison.this_design')));
    this.headings = [t('comparison.reference'), t('comparison.difference')].map((text) => html('th', { scope: 'col', class: 'numeric compared' }, text));
    head.append(...this.headings, html('th', { scope: 'col' }, t('result.where')));
    table.append(html('thead', {}, head));
    for (const group of GROUPS) {
      const offer = group.offer && html('button', { type: 'button', class: 'link', 'aria-label': t('result.ask_for', { what: group.title }), onclick: () => onAsk(group.offer) }, t('result.ask'));
      const told = group.told && html('span', { class: 'told' });
      if (told) this.#told.push({ group, told });
      const heading = html('tr', { class: group.isOnScreenAlone ? 'group unasked' : 'group' }, html('th', { scope: 'rowgroup', colspan: 5 }, group.title, offer && [' ', offer], told && [' ', told]));
      const body = html('tbody', { class: group.isMore && 'more' }, heading);
      if (offer) this.#offers.push({ group, offer, heading });
      for (const entry of group.rows) {
        const value = html('data', { class: 'number' });
        const reference = html('span', { class: 'number' });
        // Words stand where numbers have their unit.
        const [unit, referenceUnit] = [value, reference].map(() => !entry.text && html('span', { class: 'unit' }));
        const delta = html('td', { class: 'numeric compared number' });
        const place = entry.place && html('button', { type: 'button', class: 'link number', title: t('result.show') });
        const scope = entry.scoped && html('span');
        const name = html('span', {}, entry.label);
        const taken = entry.taken && html('button', { type: 'button', class: 'link number', 'aria-label': t('result.take_over_as', { what: entry.label }) }, t('result.take_over'));
        const cell = { entry, name, taken, scope, value, unit, reference, referenceUnit, delta, place };
        place?.addEventListener('click', () => onShow(cell.at));
        taken?.addEventListener('click', () => onTake(entry.taken(cell.answers), cell.answers));
        const kind = entry.text ? 'numeric words' : 'numeric';
        const line = html(
          'tr',
          { class: group.isOnScreenAlone ? 'unasked' : entry.followsFromRatio ? 'follows' : '' },
          html('th', { scope: 'row' }, name, scope, entry.symbol && [' ', symbol(entry.symbol)], entry.terms && [' ', term(...entry.terms)]),
          html('td', { class: kind }, value, unit),
          html('td', { class: `${kind} compared` }, reference, referenceUnit),
          [delta, html('td', { class: 'place' }, place ?? taken)],
        );
        this.#cells.push(Object.assign(cell, { line }));
        body.append(line);
      }
      table.append(body);
    }
  }

  /** Shows answers, and beside them those of a reference; `isHeld` says that no row may go, because a slider is held. */
  update(answers, reference, isHeld) {
    this.table.classList.toggle('comparing', Boolean(reference));
    for (const { group, offer, heading } of this.#offers) {
      const isAnswered = (given) => given && group.rows[0].get(given) !== undefined;
      setProperties(offer, { hidden: Boolean(isAnswered(answers)) });
      // Paper shows only what was asked for.
      heading.classList.toggle('unasked', !isAnswered(answers) && !isAnswered(reference));
    }
    for (const { group, told } of this.#told) setText(told, group.told(answers));
    for (const cell of this.#cells) {
      const { entry, name, scope, line, value, unit, reference: other, referenceUnit, delta, place } = cell;
      const shown = show(entry, answers);
      const otherShown = reference && show(entry, reference);
      setProperties(line, { hidden: !shown && !otherShown && (line.hidden || !isHeld) });
      if (scope) setText(scope, scopeOf(entry, answers));
      if (entry.name && shown) setText(name, entry.name(answers));
      write(value, shown);
      setText(other, otherShown?.text ?? DASH);
      if (unit) {
        setText(unit, shown ? entry.unit : '');
        setText(referenceUnit, otherShown ? entry.unit : '');
      }
      setText(delta, reference ? compare(entry, answers, reference) : '');
      cell.at = place && shown && entry.place(answers);
      if (cell.taken) {
        cell.answers = answers;
        setProperties(cell.taken, { hidden: !entry.taken(answers) });
      }
      if (place) setProperties(place, { hidden: !cell.at });
      if (cell.at) {
        setText(place, `j ${number(cell.at.input_angle_deg, 4)}°, ψ ${number(cell.at.position_deg, 4)}°`);
      }
    }
  }
}
