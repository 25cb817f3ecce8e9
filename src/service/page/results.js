// What a designer decides by, as a table: each row is one entry here. A result that the service does not answer is not shown.

import { html, setProperties, setText, symbol } from './dom.js';
import { DASH, difference, number } from './format.js';
import { CONTACTS } from './motion.js';
import { term } from './terms.js';

const row = (label, sign, unit, get, more) => ({ label, symbol: sign, unit, get, ...more });

const peakRows = (field, name, sign, unit) =>
  CONTACTS.map(({ key, name: contact, index }) =>
    row(`${name}, ${contact.toLowerCase()}`, `${sign}_${index}`, unit, ({ sweep }) => sweep?.peaks[key][field].value, {
      place: ({ sweep }) => sweep.peaks[key][field],
    }),
  );

/** What goes with the largest stress of each contact. */
const contactRows = (field, name, sign, unit) =>
  CONTACTS.map(({ key, name: contact, index }) =>
    row(`${name}, ${contact.toLowerCase()}`, `${sign}_${index}`, unit, ({ sweep }) => sweep?.peaks[key][field]),
  );

const least = (column) => column?.reduce((most, value) => Math.min(most, value));
const greatest = (column) => column?.reduce((most, value) => Math.max(most, value));

const percent = (share) => `${share > 0 ? '+' : share < 0 ? '−' : ''}${Math.abs(Math.round(100 * share))}`;
const span = ({ low, high }) => `${percent(low)} to ${percent(high)} %`;
const BEYOND = {
  law: 'other sizes and loads under its law',
  tooth_shape: 'its shape of teeth',
  lobes: 'its lobes',
  ring_with_more_teeth: 'a ring with more teeth',
  pressure_angle: 'a steeper flank',
  entry_under_load: 'teeth that enter under load',
  materials: 'unlike materials',
  gap: 'larger clearances',
  wind_up: 'a larger wind-up',
  modification: 'its modification',
  series_compliance: 'what gives way behind its contacts',
  soft_backing: 'soft parts behind its contacts',
  half_width: 'wider contacts',
};

/** How far to believe some numbers: what the model was found to err by in drives of this case, calculated as elastic bodies. What is not like
 *  those drives is said once, at the peaks. */
function believed(what, { sweep }, saysWhatIsUnlike) {
  if (!sweep) return '';
  const { measured, beyond } = sweep.model_error;
  if (!measured) return 'The model’s own error: not measured under this law.';
  const outside = saysWhatIsUnlike && beyond.length > 0 ? `; not measured with ${beyond.map((reason) => BEYOND[reason] ?? reason.replaceAll('_', ' ')).join(', ')}` : '';
  return `The model’s own error: ${what(measured)}${outside}.`;
}

const HELD = {
  housed: 'a housed rim and fingers held at both ends',
  slender_fingers: 'slender fingers',
  fingers_at_one_end: 'fingers held at one end',
  free_rim: 'a rim with nothing around it',
};

/** What comes on top for how the parts are held. */
function heldAs({ sweep }) {
  const { held } = sweep.model_error;
  if (!held) return '';
  const earlier = held.wind_up ? `, ${span(held.wind_up)} in earlier calculations of elastic bodies` : '';
  return ` Besides, for ${HELD[held.case] ?? held.case}: by the estimates ${percent(held.estimated_wind_up)} %${earlier}.`;
}

/** The contact that carries the largest of a quantity. */
function largest(field, { sweep }) {
  if (!sweep) return undefined;
  const peaks = CONTACTS.map(({ key, name }) => ({ name, peak: sweep.peaks[key][field] }));
  return peaks.reduce((most, candidate) => (candidate.peak.value > most.peak.value ? candidate : most));
}

const largestRow = (label, field, unit) =>
  row(label, '', unit, (answers) => largest(field, answers)?.peak.value, {
    note: (answers) => {
      const { name, peak } = largest(field, answers);
      return `${name.toLowerCase()}, ψ ${number(peak.position_deg, 3)}°`;
    },
  });

/** Of what friction takes. */
const lossRow = (label, sign, unit, get, more) => row(label, sign, unit, ({ sweep }) => sweep?.losses && get(sweep.losses), more);

const percentRow = (label, sign, get, more) => lossRow(label, sign, '%', (losses) => { const share = get(losses); return share === undefined ? undefined : 100 * share; }, more);

const PLACES = [...CONTACTS.map(({ key, name }) => ({ key, name: key === 'wave_generator' ? 'cam or race' : name.toLowerCase() })), { key: 'bearing', name: 'bearing' }];

const lossRows = [
  percentRow('Efficiency, ring fixed', 'η', ({ efficiency }) => efficiency.ring_fixed, { significant: 4 }),
  percentRow('Driven from behind, ring fixed', 'η', ({ efficiency }) => efficiency.ring_fixed_back_driven, {
    text: ({ sweep: { losses } }) => (losses.self_locking ? 'locks itself' : `${number(100 * losses.efficiency.ring_fixed_back_driven, 4)} %`),
  }),
  percentRow('The efficiency may be off by', '', ({ efficiency_error: error }) => error, { significant: 2 }),
  lossRow('Input torque with losses, ring fixed', 'M', 'N·m', ({ required_input_torque_nm: torque }) => torque),
  lossRow('Power lost, ring fixed', 'P', 'W', ({ power_loss_w: power }) => power),
  ...PLACES.map(({ key, name }) => percentRow(`Of it at the ${name}`, '', ({ loss_ratio: whole, loss_ratio_by_place: part }) => (whole > 0 ? part[key] / whole : undefined), { significant: 3 })),
  ...CONTACTS.map(({ key, name, index }) =>
    lossRow(`Pressure times velocity, ${name.toLowerCase()}`, `pv_${index}`, 'MPa m/s', ({ pressure_velocity_mpa_m_per_s: peaks }) => peaks?.[key].value, {
      place: ({ sweep }) => sweep.losses.pressure_velocity_mpa_m_per_s[key],
      significant: 4,
      terms: key === 'wave_generator' ? ['pressure_velocity'] : undefined,
    }),
  ),
  ...CONTACTS.map(({ key, name }) => {
    const wear = (losses) => losses.wear_mm_per_hour?.[key];
    return lossRow(`Wear, ${name.toLowerCase()}, µm/h`, '', '', (losses) => wear(losses) && 1000 * wear(losses).value, {
      significant: 3,
      place: ({ sweep }) => (wear(sweep.losses).position_deg === undefined ? undefined : wear(sweep.losses)),
      terms: key === 'wave_generator' ? ['wear'] : undefined,
    });
  }),
  lossRow('Mean load on the bearing', 'P', 'N', ({ bearing }) => bearing?.mean_load_n),
  lossRow('Life of the bearing, h', 'L_10', '', ({ bearing }) => bearing?.life_h, { significant: 3 }),
];

const BACKINGS = {
  cam_on_bore: 'Cam on its bore',
  housed_rim: 'Rim in a housing',
  free_rim: 'Rim with nothing around it',
  finger_at_both_ends: 'Finger held at both ends',
  finger_at_one_end: 'Finger held at one end',
  finger_joined_at_far_end: 'Finger joined at its far end',
  finger_on_web: 'Finger on a web in its middle',
};

/** What parts behind the contacts are estimated to give way, to be taken over as series compliance. */
const backingRows = Object.entries(BACKINGS).map(([key, label]) => {
  const of = ({ sweep }) => sweep?.series_compliance_estimates?.find(({ backing }) => backing === key);
  return row(label, '', 'mm/N', (answers) => of(answers)?.compliance_mm_per_n, {
    significant: 3,
    taken: (answers) => {
      const { contact, compliance_mm_per_n: compliance, share } = of(answers);
      const adds = share === undefined ? '' : `, adds ${number(100 * share, 2)} %`;
      return { pointer: `/model/series_compliance_mm_per_n/${contact}`, value: Number(compliance.toPrecision(3)), text: `take over${adds}` };
    },
  });
});

const backlashOf = ({ sweep }) => sweep?.wind_up?.backlash;
const backlashRow = (label, get) => row(label, '', 'arcmin', (answers) => backlashOf(answers) && get(backlashOf(answers)), { significant: 4 });

const backlashRows = [
  backlashRow('Mean backlash of the output', ({ mean_arcmin: mean }) => mean),
  backlashRow('Least backlash of the output', ({ smallest_arcmin: smallest }) => smallest),
  backlashRow('Most backlash of the output', ({ largest_arcmin: largest }) => largest),
  ...CONTACTS.map(({ key, name }) => backlashRow(`Backlash by ${name.toLowerCase()}`, ({ contribution_arcmin: part }) => part[key])),
];

const LIMITS = { finger_yield: 'finger yield', finger_fatigue: 'finger fatigue' };

const limitOf = ({ sweep: { torque_capacity: { limited_by: limit, turns_past_teeth: turns } } }) =>
  turns ? 'turning past the teeth' : (LIMITS[limit] ?? CONTACTS.find(({ key }) => key === limit).name.toLowerCase());

const HOLDINGS = {
  held_at_one_end: 'held at one end',
  held_at_both_ends: 'held at both ends',
  far_ends_joined: 'far ends joined',
  web_in_the_middle: 'on a web',
};

const heldOf = ({ sweep: { fingers } }) => HOLDINGS[fingers.fingers];

const safetyTile = {
  ...row('Safety of the fingers', '', '', ({ sweep }) => sweep?.fingers?.safety, { significant: 3 }),
  note: (answers) => `${heldOf(answers)}${answers.sweep.fingers.is_assumed ? ', assumed' : ''}`,
  state: ({ sweep }) => (sweep.fingers.safety < 1 ? 'warning' : ''),
  isOptional: true,
};

const capacityTile = {
  ...row('Torque capacity', '', 'N·m', ({ sweep }) => sweep?.torque_capacity?.output_torque_nm, { significant: 4 }),
  note: (answers) => `output; limited by ${limitOf(answers)}${answers.sweep.torque_capacity.limited_by in LIMITS ? '' : ' contact'}`,
  isOptional: true,
};

const backlashTile = {
  ...backlashRow('Mean backlash', ({ mean_arcmin: mean }) => mean),
  note: (answers) => `${number(backlashOf(answers).smallest_arcmin, 4)} to ${number(backlashOf(answers).largest_arcmin, 4)} arcmin, unloaded`,
  state: (answers) => (backlashOf(answers).smallest_arcmin < -1e-9 ? 'warning' : ''),
  isOptional: true,
};

/** Always in sight, however far one scrolls. */
const KEY_ROWS = [
  row('Ratio, ring fixed', '', '', ({ geometry }) => geometry?.transmission_ratio),
  row('Contact ratio', '', '', ({ coincidence }) => coincidence?.coincidence_degree, {
    note: ({ coincidence }) => `from ψ ${number(coincidence.engagement.start_deg, 4)}°`,
    terms: ['coincidence', 'position'],
  }),
  row('Teeth in mesh', '', '', ({ coincidence }) => coincidence?.teeth_in_mesh_per_zone.max, {
    text: ({ coincidence: { teeth_in_mesh_per_zone: { min, max } } }) => (min === max ? `${min}` : `${min} to ${max}`),
    scoped: true,
  }),
  largestRow('Largest force', 'force_n', 'N'),
  largestRow('Largest stress', 'stress_mpa', 'MPa'),
  percentRow('Efficiency', '', ({ efficiency }) => efficiency.ring_fixed, {
    significant: 3,
    note: ({ sweep: { losses } }) => (losses.self_locking ? 'ring fixed; locks itself' : `ring fixed; ${number(100 * losses.efficiency.ring_fixed_back_driven, 3)} % from behind`),
    isOptional: true,
  }),
  capacityTile,
  safetyTile,
  backlashTile,
  row('Undercut', '', '', ({ geometry }) => geometry && Number(geometry.undercut.occurs), {
    text: ({ geometry }) => (geometry.undercut.occurs ? 'yes' : 'no'),
    note: ({ geometry: { undercut } }) =>
      undercut.critical_tooth_radius_mm === undefined ? 'at no radius' : `critical r ${number(undercut.critical_tooth_radius_mm, 4)} mm`,
    state: ({ geometry }) => (geometry.undercut.occurs ? 'warning' : 'good'),
    keepsNote: true,
  }),
];

export const GROUPS = [
  {
    title: 'Peaks over a period',
    told: (answers) => believed(({ force, stress }) => `force ${span(force)}, stress ${span(stress)}`, answers, true),
    rows: [...peakRows('force_n', 'Force', 'F', 'N'), ...peakRows('stress_mpa', 'Contact stress', 'σ', 'MPa')],
  },
  {
    title: 'Torque capacity at the allowable stress',
    told: ({ sweep }) => (sweep?.torque_capacity && sweep.fingers && sweep.fingers.safety === undefined ? 'Without the carrier’s fingers.' : ''),
    offer: '/load/allowable_stress_mpa',
    rows: [
      row('Input torque', 'M_0', 'N·m', ({ sweep }) => sweep?.torque_capacity?.input_torque_nm),
      row('Output torque', 'M_G', 'N·m', ({ sweep }) => sweep?.torque_capacity?.output_torque_nm),
      row('Limited by', '', '', ({ sweep }) => sweep?.torque_capacity?.limited_by, {
        text: limitOf,
      }),
      row('At the input angle', 'j', 'deg', ({ sweep }) => sweep?.torque_capacity?.input_angle_deg),
    ],
  },
  {
    title: 'Strength of the carrier’s fingers',
    offer: '/parts/carrier/strength',
    rows: [
      row('Safety', 'S', '', ({ sweep }) => sweep?.fingers?.safety, { significant: 3 }),
      row('Safety against yield', 'S_F', '', ({ sweep }) => sweep?.fingers?.yield_safety, { significant: 3 }),
      row('Safety against fatigue', 'S_D', '', ({ sweep }) => sweep?.fingers?.fatigue_safety, { significant: 3 }),
      row('Largest stress at the foot', 'σ', 'MPa', ({ sweep }) => sweep?.fingers?.stress_mpa, { significant: 4 }),
      row('Support', '', '', ({ sweep }) => sweep?.fingers?.stress_mpa, { text: heldOf }),
      row('Load along a tooth over its mean', 'κ', '', ({ sweep }) => sweep?.fingers?.load_peak_over_mean, { significant: 3 }),
    ],
  },
  {
    title: 'Wind-up and stiffness',
    offer: '/sweep/wind_up',
    told: (answers) => (answers.sweep?.wind_up ? `${believed(({ wind_up: windUp }) => `wind-up ${span(windUp)} where bodies are held at the law’s depth`, answers, false)}${heldAs(answers)}` : ''),
    rows: [
      row('Least wind-up of the input', 'Δφ', 'deg', ({ sweep }) => least(sweep?.wind_up?.wind_up_deg)),
      row('Most wind-up of the input', 'Δφ', 'deg', ({ sweep }) => greatest(sweep?.wind_up?.wind_up_deg)),
      row('Least torsional stiffness of the output, N·m/rad', '', '', ({ sweep }) => least(sweep?.wind_up?.torsional_stiffness_nm_per_rad)),
      row('Most torsional stiffness of the output, N·m/rad', '', '', ({ sweep }) => greatest(sweep?.wind_up?.torsional_stiffness_nm_per_rad)),
      row('Transmission error, peak to peak', '', 'deg', ({ sweep }) => sweep?.wind_up?.transmission_error_peak_to_peak_deg),
      ...backlashRows,
    ],
  },
  { title: 'Friction losses and wear', offer: '/friction/wave_generator', rows: lossRows },
  {
    title: 'Motion and mesh',
    rows: [
      row('Ratio, ring fixed', 'i_HG', '', ({ geometry }) => geometry?.transmission_ratio),
      row('Ratio, carrier fixed', 'i_HK', '', ({ geometry }) => geometry?.transmission_ratio_carrier_fixed),
      row('Ratio of ring to carrier, wave generator fixed', 'i_KG', '', ({ geometry }) => geometry?.members.wave_generator_fixed.ratio),
      row('Ring fixed, its torque over the input’s', '', '', ({ geometry }) => geometry?.members.ring_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row('Carrier fixed, its torque over the input’s', '', '', ({ geometry }) => geometry?.members.carrier_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row('Wave generator fixed, its over the ring’s', '', '', ({ geometry }) => geometry?.members.wave_generator_fixed.holding_torque_ratio, { followsFromRatio: true }),
      row('Period of the load pattern', '', 'deg', ({ geometry }) => geometry?.period_deg),
      row('Contact ratio, all zones', 'ε', '', ({ coincidence }) => coincidence?.coincidence_degree, { significant: 7, terms: ['coincidence'] }),
      row('Fewest teeth in mesh', '', '', ({ coincidence }) => coincidence?.teeth_in_mesh_per_zone.min, { scoped: true }),
      row('Most teeth in mesh', '', '', ({ coincidence }) => coincidence?.teeth_in_mesh_per_zone.max, { scoped: true }),
      row('Fewest teeth that carry', '', '', ({ sweep }) => sweep?.carrying_teeth?.min, { scoped: true }),
      row('Most teeth that carry', '', '', ({ sweep }) => sweep?.carrying_teeth?.max, { scoped: true }),
      row('Engagement begins, from a lobe’s middle', 'ψ_e', 'deg', ({ geometry }) => geometry?.engagement.start_deg, { terms: ['position'] }),
      row('Undercut', '', '', ({ geometry }) => geometry && Number(geometry.undercut.occurs), {
        text: ({ geometry }) => (geometry.undercut.occurs ? 'yes' : 'no'),
      }),
      row('Critical tooth radius', 'r_c', 'mm', ({ geometry }) => geometry?.undercut.critical_tooth_radius_mm, { significant: 6 }),
    ],
  },
  {
    title: 'Sizes and clearances',
    rows: [
      row('Ring root radius', '', 'mm', ({ geometry }) => geometry?.ring.root_radius_mm),
      row('Ring tip radius', '', 'mm', ({ geometry }) => geometry?.ring.tip_radius_mm),
      row('Ring tooth height', '', 'mm', ({ geometry }) => geometry?.ring.tooth_height_mm),
      row('Largest pressure angle, ring', 'β', 'deg', ({ geometry }) => geometry?.ring.pressure_angle_max_deg),
      row('Largest pressure angle, cam', 'γ', 'deg', ({ geometry }) => geometry?.wave_generator.pressure_angle_max_deg),
      row('Radial space for the carrier', '', 'mm', ({ geometry }) => geometry?.carrier.radial_space_mm),
      row('Thinnest wall between slots', '', 'mm', ({ geometry }) => geometry?.carrier.slot_wall_mm),
      row('Least gap between teeth', '', 'mm', ({ geometry }) => geometry?.teeth.gap_min_mm),
    ],
  },
  {
    title: 'Below the surface, where the stress peaks',
    isMore: true,
    rows: [
      ...contactRows('half_width_mm', 'Half-width of the contact', 'w', 'mm'),
      ...contactRows('half_length_mm', 'Half-length of the contact, along the axis', 'c', 'mm'),
      ...contactRows('shear_stress_mpa', 'Largest shear stress', 'τ', 'MPa'),
      ...contactRows('shear_depth_mm', 'Its depth', 'z', 'mm'),
    ],
  },
  {
    title: 'Compliance of the supports, estimated',
    isMore: true,
    // To work with, not to report: what was taken over stands in the design.
    isOnScreenAlone: true,
    told: ({ sweep }) => (sweep?.series_compliance_estimates?.length > 0 ? 'From the parts as they are made; forces leave it out until it is taken over.' : ''),
    rows: backingRows,
  },
  {
    title: 'Checks of the calculation',
    isMore: true,
    rows: [
      row('Torque balance, residual', '', '', ({ sweep }) => sweep?.checks.torque_balance_residual, { noDifference: true }),
      row('Period closure, residual', '', '', ({ sweep }) => sweep?.checks.period_closure_residual, { noDifference: true }),
    ],
  },
];

/** What a count of teeth is over: where zones are unlike, over all of them. */
const scopeOf = ({ scoped }, { zones }) => (scoped ? (zones?.areAlike === false ? ', all zones' : ', each zone') : '');

function show(entry, answers) {
  const value = entry.get(answers);
  if (value === undefined) return undefined;
  const text = entry.text?.(answers) ?? number(value, entry.significant ?? 5);
  return { value, text };
}

function compare(entry, answers, reference) {
  const value = entry.get(answers);
  const other = entry.get(reference);
  if (value === undefined || other === undefined || entry.noDifference) return '';
  if (!entry.text) return difference(value, other);
  return entry.text(answers) === entry.text(reference) ? '=' : 'differs';
}

export class Results {
  #cells = [];
  #tiles = [];
  #offers = [];
  #told = [];

  /** `onShow({ input_angle_deg, position_deg })` when a peak's place is picked, `onAsk(pointer)` when a result is wanted that the
   *  design has to ask for, `onTake({ pointer, value })` when an estimate is taken over into the design. */
  constructor({ keyFigures, table }, onShow, onAsk, onTake) {
    for (const entry of KEY_ROWS) {
      const value = html('data', { class: 'value number' });
      const unit = entry.unit && !entry.text ? html('span', { class: 'unit' }, entry.unit) : undefined;
      const note = html('span', { class: 'tile-note number' });
      const scope = entry.scoped && html('span');
      const tile = html('div', { class: 'tile', hidden: Boolean(entry.isOptional) }, html('dt', {}, html('span', {}, entry.label, scope), entry.terms && term(...entry.terms)), html('dd', {}, value, unit && [' ', unit], note));
      this.#tiles.push({ entry, tile, value, note, scope });
      keyFigures.append(tile);
    }
    this.table = table;
    const head = html('tr', {}, html('th', { scope: 'col' }, 'Result'), html('th', { scope: 'col', class: 'numeric' }, 'This design'));
    this.headings = ['Reference', 'Difference'].map((text) => html('th', { scope: 'col', class: 'numeric compared' }, text));
    head.append(...this.headings, html('th', { scope: 'col' }, 'Where'));
    table.append(html('thead', {}, head));
    for (const group of GROUPS) {
      const offer = group.offer && html('button', { type: 'button', class: 'link', 'aria-label': `${group.title}: ask for it`, onclick: () => onAsk(group.offer) }, 'ask for it');
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
        const place = entry.place && html('button', { type: 'button', class: 'link number', title: 'Show in mechanism and plots' });
        const scope = entry.scoped && html('span');
        const taken = entry.taken && html('button', { type: 'button', class: 'link number', 'aria-label': `${entry.label}: take over as series compliance` });
        const cell = { entry, taken, scope, value, unit, reference, referenceUnit, delta, place };
        place?.addEventListener('click', () => onShow(cell.at));
        taken?.addEventListener('click', () => onTake(entry.taken(cell.answers)));
        const line = html(
          'tr',
          { class: group.isOnScreenAlone ? 'unasked' : entry.followsFromRatio ? 'follows' : '' },
          html('th', { scope: 'row' }, entry.label, scope, entry.symbol && [' ', symbol(entry.symbol)], entry.terms && [' ', term(...entry.terms)]),
          html('td', { class: 'numeric' }, value, unit),
          html('td', { class: 'numeric compared' }, reference, referenceUnit),
          [delta, html('td', { class: 'place' }, place ?? taken)],
        );
        this.#cells.push(Object.assign(cell, { line }));
        body.append(line);
      }
      table.append(body);
    }
  }

  #noteOf(entry, answers, reference) {
    if (!reference || entry.keepsNote) return entry.note?.(answers) ?? '';
    const difference = compare(entry, answers, reference);
    return difference === 'differs' ? `reference: ${entry.text(reference)}` : difference;
  }

  /** Shows answers in the tiles and the table, and beside them those of a reference. What has no answer keeps its place but no number; `isHeld`
   *  says that no tile or row may go, because a slider is held. */
  updateKeyFigures(answers, reference, isHeld) {
    for (const { entry, tile, value, note, scope } of this.#tiles) {
      if (scope) setText(scope, scopeOf(entry, answers));
      const shown = show(entry, answers);
      // What a design need not ask for takes no room where it does not.
      setProperties(tile, { hidden: Boolean(entry.isOptional) && !shown && (tile.hidden || !isHeld) });
      setText(value, shown?.text ?? DASH);
      if (shown) setProperties(value, { value: String(shown.value) });
      setProperties(tile.dataset, { state: (shown && entry.state?.(answers)) ?? '' });
      setText(note, shown ? this.#noteOf(entry, answers, reference) : '');
    }
  }

  updateTable(answers, reference, isHeld) {
    this.table.classList.toggle('comparing', Boolean(reference));
    for (const { group, offer, heading } of this.#offers) {
      const isAnswered = (given) => given && group.rows[0].get(given) !== undefined;
      setProperties(offer, { hidden: Boolean(isAnswered(answers)) });
      // Paper shows only what was asked for.
      heading.classList.toggle('unasked', !isAnswered(answers) && !isAnswered(reference));
    }
    for (const { group, told } of this.#told) setText(told, group.told(answers));
    for (const { entry, scope } of this.#cells) if (scope) setText(scope, scopeOf(entry, answers));
    for (const cell of this.#cells) {
      const { entry, line, value, unit, reference: other, referenceUnit, delta, place } = cell;
      const shown = show(entry, answers);
      const otherShown = reference && show(entry, reference);
      setProperties(line, { hidden: !shown && !otherShown && (line.hidden || !isHeld) });
      setText(value, shown?.text ?? DASH);
      if (shown) setProperties(value, { value: String(shown.value) });
      setText(other, otherShown?.text ?? DASH);
      if (unit) {
        setText(unit, shown ? entry.unit : '');
        setText(referenceUnit, otherShown ? entry.unit : '');
      }
      setText(delta, reference ? compare(entry, answers, reference) : '');
      cell.at = place && shown && entry.place(answers);
      if (cell.taken) {
        cell.answers = answers;
        setProperties(cell.taken, { hidden: !shown });
        if (shown) setText(cell.taken, entry.taken(answers).text);
      }
      if (place) setProperties(place, { hidden: !cell.at });
      if (cell.at) {
        setText(place, `j ${number(cell.at.input_angle_deg, 4)}°, ψ ${number(cell.at.position_deg, 4)}°`);
      }
    }
  }
}
