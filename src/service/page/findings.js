// Findings and reasons in words. Why a finding matters and what to change come with it; what it tests stands here.

import { html } from './dom.js';
import { number, withUnit } from './format.js';
import { CONTACTS } from './motion.js';

/** Where a limit comes from, in a word and in a sentence. */
const GEOMETRY = ['exact', 'The limit is geometry, exact.'];
const RULE_OF_THUMB = ['rule of thumb', 'The limit is a rule of thumb: it marks where to look again.'];

/** By code: a title, what is tested and where its limit comes from, and what `detail` and `advice` leave to be said. */
const KINDS = {
  undercut: {
    title: 'Undercut ring tips',
    tests: 'The tooth radius against the critical radius, from which the envelope of the passing tooth cuts into the ring’s own tips.',
    basis: GEOMETRY,
    change: 'Fewer ring teeth help too. Or live with it: bore the tips, and judge the loads by the plots.',
  },
  bore_shortens_flank: {
    title: 'Bore shortens the flank',
    tests: 'The bored tip radius against the ring’s natural tip radius.',
    basis: GEOMETRY,
    change: 'A bore that only breaks a pointed tip costs little.',
  },
  bore_without_effect: {
    title: 'Bore without effect',
    tests: 'The bored tip radius against the ring’s natural tip radius.',
    basis: GEOMETRY,
    why: 'The results are those of a ring without a bore, which may not be what the number was meant to say.',
  },
  few_teeth_in_mesh: {
    title: 'Few teeth in mesh',
    tests: 'The fewest teeth in mesh at once in a zone, or where zones are unlike in all of them together, at any input angle, against two.',
    basis: RULE_OF_THUMB,
  },
  thin_slot_wall: {
    title: 'Thin wall between slots',
    tests: 'The carrier’s wall between two slots at its inner edge against a quarter of a slot’s width.',
    basis: RULE_OF_THUMB,
    why: 'The wall takes the slot’s force as a bending load, and it is thinnest just where the carrier ends.',
  },
  tooth_beyond_carrier: {
    title: 'Tooth leaves the carrier',
    tests: 'The radius that a loaded tooth’s centre reaches against the edge of the annulus between cam and ring tips.',
    basis: ['no clearance', 'The limit is that of a carrier without clearance; a real one is smaller.'],
    why: 'The contact stress of a flat wall is then too favourable.',
  },
  steep_ring_flank: {
    title: 'Steep ring flank',
    tests: 'The largest pressure angle on the engaged flank of the ring.',
    basis: RULE_OF_THUMB,
  },
  hollow_wave_generator: {
    title: 'Hollow wave generator',
    tests: 'The amplitude of the path against the largest that leaves the wave generator convex.',
    basis: ['exact', 'The limit is geometry.'],
    why: 'A solid wave generator turns as calculated; the ring of a bearing spans the hollow and moves the teeth otherwise.',
  },
  flat_cuts_the_contact: {
    title: 'Flats cut the contact',
    tests: 'The length of a tooth’s flats against the longest that leaves its steepest contact with the ring on the arc.',
    basis: ['exact', 'The limit is geometry, without the width of the contact itself.'],
    why: 'Beyond that place a tooth would touch the ring with the edge of its flat.',
  },
  contact_beyond_groove: {
    title: 'Contact longer than its groove',
    tests: 'Half the length of a ball’s contact, where its stress peaks, against half the width at its edges of a groove half as deep as the ball’s radius.',
    basis: RULE_OF_THUMB,
    why: 'On an edge the stress is many times that of the ellipse, which then is not there. The document does not say how deep a groove is: of a shallower one the limit is less.',
  },
  groove_not_drawn: {
    title: 'Groove not drawn',
    tests: 'Whether a part has a groove for balls.',
    basis: ['exact', 'Drawings have the outline in the middle of the width alone, which is the bottom of the groove.'],
    why: 'A part that is made as it is drawn has a straight wall there, on which the stress is larger than calculated.',
  },
  johnson_beyond_half_width: {
    title: 'Contact wide for Johnson’s law',
    tests: 'Half the width of a contact against a tenth of the tooth’s radius or of the depth, whichever is less.',
    basis: RULE_OF_THUMB,
    why: 'The law is that of a narrow strip: the wider the contact, the more its approach comes out too small.',
  },
  wind_up_beyond_model: {
    title: 'Wind-up beyond the model',
    tests: 'The largest wind-up of the wave generator under the load against a tenth of the period; where it moves on under its teeth, against a quarter of a radian over the number of its lobes.',
    basis: RULE_OF_THUMB,
    why: 'Lever arms and directions are those of the drive without load; a wind-up of one period moves every tooth on by a whole spacing.',
    change: 'A torque that suits the drive, or clearances that do.',
  },
  negative_backlash: {
    title: 'Interference of both flanks',
    tests: 'The least backlash at the output over the input angle, parts taken as rigid, against zero.',
    basis: ['exact', 'To first order in the gaps.'],
    why: 'Teeth on both flanks are pressed before any load: the drive turns only by force, or cannot be assembled.',
  },
  tooth_leaves_slot: {
    title: 'Tooth leaves its slot',
    tests: 'How far the teeth’s centres go, against where the drawn carrier’s slot walls end.',
    basis: GEOMETRY,
    why: 'Beyond the end of its wall a tooth presses on an edge, or on nothing.',
  },
  thin_wall_as_made: {
    title: 'Thin wall of a drawn part',
    tests: 'The drawn ring’s rim, or the wave generator’s wall around its bore, against a quarter of a slot’s width.',
    basis: RULE_OF_THUMB,
    why: 'Forces and stresses are those of rigid parts.',
  },
  clearance_undercuts_ring: {
    title: 'Set-back flank undercuts the ring',
    tests: 'The drawn flank’s distance from the path of the teeth’s centres, the tooth radius and how far the flank is set back by clearance or modification, against the one that undercuts.',
    basis: GEOMETRY,
    why: 'Results are those of the flank that is not set back, which is longer.',
  },
  friction_beyond_measured: {
    title: 'Friction beyond what was measured',
    tests: 'The largest coefficient of friction, and the friction along the wave generator as a whole, against the ranges in which losses were held against exact equilibria.',
    basis: ['measured', 'The limit is the end of the range that was measured: 0.1, and 0.05 along the wave generator.'],
    why: 'Losses are taken to first order; how far that is off here, nobody has looked.',
  },
  efficiency_uncertain: {
    title: 'Efficiency uncertain',
    tests: 'How far the efficiency with the ring fixed may be from that of an exact equilibrium, against five hundredths.',
    basis: ['measured', 'The error is the largest that was measured at such coefficients and such a loss; the limit is a rule of thumb.'],
    why: 'The loss is large either way: a wave generator on a bearing loses a fraction of it, and is known better.',
  },
  bearing_load_above_half_rating: {
    title: 'Bearing loaded beyond its life’s equation',
    tests: 'The mean load on the bearing that is the wave generator, of a duty at the point where it is largest, against half its dynamic load rating.',
    basis: ['ISO 281:2007', 'The limit is that of ISO 281:2007, up to which its equation for the life holds.'],
    why: 'Under more than that its parts give way for good, and it may last less long than calculated. A static load rating below half the dynamic one is a limit of its own, which nothing here knows.',
  },
  finger_overstressed: {
    title: 'Fingers of the carrier too weak',
    tests: 'The safety of a finger against yield and fatigue at its foot, against 1.',
    basis: ['as given', 'The strength is that of this design’s carrier; the notch is that of Roark’s formulas.'],
    why: 'A finger that yields or cracks lets its tooth go, and its neighbours take the load.',
    change: 'Stress grows with the length of the teeth and falls with the square of the thickness.',
  },
  stress_above_allowable: {
    title: 'Stress above the allowable one',
    tests: 'The peak contact stress over a period against the one that the contact may have.',
    basis: ['as given', 'The limit is the allowable stress of this design.'],
    why: 'The torque capacity is the torque at which a contact reaches its own, or a finger its strength.',
    change: 'Stress grows about with the square root of the torque, that of balls with its cube root.',
  },
  stress_above_fatigue_limit: {
    title: 'Stress above the fatigue limit',
    tests: 'The peak contact stress over a period against the fatigue limit of bearing steel.',
    basis: ['ISO 281:2007', 'The limit is that of ISO 281:2007 for rolling bearings of common high-quality steel.'],
    why: 'Above it, hardened bearing steel has to be expected to fatigue in the end, softer steel earlier; below it nothing is proven.',
    change: 'Stress grows about with the square root of the torque, that of balls with its cube root.',
  },
  linear_law_too_stiff: {
    title: 'Linear law is too stiff',
    tests: 'How far the tooth and the wave generator approach under the peak force by the linear law, against the same by Palmgren’s.',
    basis: ['Palmgren’s law', 'The limit is measured: Palmgren’s formula for steel rollers.'],
    why: 'Without clearance the forces hardly notice; torsional stiffness comes out as much too large.',
  },
  projection_on_steep_flank: {
    title: 'Projection on a steep flank',
    tests: 'The largest pressure angle of the engaged flank against 30°.',
    basis: ['measured', 'The limit lies between drives that were calculated as elastic bodies.'],
    why: 'The tooth that has just entered errs by more than the largest.',
  },
  deprecated_field: {
    title: 'Deprecated field',
    tests: 'Whether the document has a field that the next version will not know.',
    basis: ['documentation', 'docs/how-to/migration.md names what takes its place.'],
    why: 'The answer is right, and the next version will refuse the document.',
  },
  set_back_twice: {
    title: 'Surface set back twice',
    tests: 'What clearance and modification together set a surface back by, against the clearance alone.',
    basis: ['documentation', 'The two add up, as the document says.'],
    why: 'A gap that is entered in both places is twice as large as meant.',
  },
  projection_with_gap: {
    title: 'Projection with clearance',
    tests: 'The largest clearance of a contact against none.',
    basis: ['measured', 'Drives with clearance were calculated as elastic bodies.'],
    why: 'With 10 µm at the ring the largest force came out 4 to 109 % too large.',
  },
  slender_fingers: {
    title: 'Slender fingers of the carrier',
    tests: 'What a finger of the carrier gives way, as an estimated share of what a tooth gives way at its three contacts, against a fifth.',
    basis: ['measured', 'The limit is what elastic bodies in a housing were found to add altogether.'],
    why: 'The largest force comes out too large, the wind-up too small.',
  },
  soft_rim: {
    title: 'Soft rim of the ring',
    tests: 'What the ring’s rim gives way, as an estimated share of what a tooth gives way at its three contacts, against a fifth.',
    basis: ['measured', 'The limit is what elastic bodies in a housing were found to add altogether.'],
    why: 'The wind-up comes out too small; a ring with nothing around it follows the wave generator.',
  },
  palmgren_beyond_steel: {
    title: 'Palmgren’s law is for steel',
    tests: 'The contact’s elastic modulus against that of steel on steel.',
    basis: ['steel on steel', 'The limit is a rule of thumb: steels differ by less than 10 %.'],
    why: 'The law knows no modulus: load sharing, wind-up and stiffness are those of steel, only the stresses see the material.',
  },
};

const words = (code) => code.replaceAll('_', ' ').replace(/^./, (letter) => letter.toUpperCase());

export const kindOf = ({ code }) => KINDS[code]?.title ?? words(code);

/** The contact that a finding is about, where it is about one. */
export const contactOf = ({ pointers }) => CONTACTS.find(({ key }) => pointers.includes(`/materials/${key}`));

export function titleOf(finding) {
  const contact = contactOf(finding);
  return kindOf(finding) + (contact ? `, ${contact.name.toLowerCase()}` : '');
}

export const basisOf = ({ code }) => KINDS[code]?.basis[0];

/** The service spells numbers with all their digits and marks words of the document; in a sentence a designer wants the digits
 *  that matter, and quotes. */
export const readable = (text) => text.replace(/\d+\.\d{5,}/g, (digits) => number(Number(digits), 6)).replace(/`([^`]*)`/g, '“$1”');

export const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1)}${text.endsWith('.') ? '' : '.'}`;

/** What a finding means beyond its title, its numbers and its contact. */
export function meaningOf(finding) {
  const { why = '' } = KINDS[finding.code] ?? {};
  return contactOf(finding) && why ? why : `${sentence(readable(finding.detail))} ${why}`.trim();
}

/** What a finding tests, why it matters and what to change. `goTo(pointer)` leads to a field. */
export function explanation(finding, labelOf, goTo) {
  const { code, value, limit, unit, detail, advice, pointers } = finding;
  const measured = `${withUnit(number(value, 5), unit)} against ${withUnit(number(limit, 5), unit)}`;
  const { tests = '', basis: [, basis] = ['', ''], why = '', change = '' } = KINDS[code] ?? {};
  const fields = pointers.map((pointer) =>
    html('button', { type: 'button', class: 'link', onclick: () => goTo(pointer) }, labelOf(pointer)),
  );
  return html(
    'dl',
    { class: 'explanation' },
    html('dt', {}, 'What is tested'),
    html('dd', {}, `${tests} Here: ${measured}. ${basis}`.trim()),
    html('dt', {}, 'Why it matters'),
    html('dd', {}, `${sentence(readable(detail))} ${why}`),
    html('dt', {}, 'What to change'),
    html('dd', {}, `${sentence(readable(advice))} ${change} `, html('span', { class: 'fields' }, fields)),
  );
}

/** All findings of a result, each once, with a key that stays while numbers change. */
export function findingsOf(answers) {
  const unique = new Map();
  for (const finding of [answers.sweep, answers.geometry, answers.coincidence].flatMap((answer) => answer?.findings ?? [])) {
    unique.set(JSON.stringify([finding.code, finding.detail]), finding);
  }
  const counts = new Map();
  return [...unique.values()].map((finding) => {
    const name = `${finding.code}-${contactOf(finding)?.key ?? ''}`;
    const count = (counts.get(name) ?? 0) + 1;
    counts.set(name, count);
    return { ...finding, key: `${name}-${count}` };
  });
}

/** All reasons of a result's problems, each once; a problem without fields is a reason of the whole design. */
export function reasonsOf(problems) {
  const unique = new Map();
  for (const problem of problems) {
    const errors = problem.errors?.length ? problem.errors : [{ pointer: '', code: problem.code, detail: problem.detail }];
    for (const error of errors) unique.set(`${error.pointer} ${error.code} ${error.detail}`, { ...error, detail: readable(error.detail), title: problem.title });
  }
  return [...unique.values()];
}
