// Each kind of wave generators, teeth and contact laws: chosen in the form, calculated, drawn.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { KINDS } from '../../src/service/page/kinds.js';
import { choose, designOf, enter, field, pick as pressInMenu, resultOf, setDocument, settled, testBed } from './harness.js';

const WAVE_GENERATOR = '/drive/wave_generator';
const TEETH = '/drive/teeth';
const LAW = '/model/stiffness';
const bed = testBed({ before, after, afterEach });

const fieldsIn = (page, pointer) =>
  page.$$eval(`#form input[id^="field${pointer.replaceAll('/', '-')}-"]`, (inputs) => inputs.filter((input) => input.checkVisibility()).map(({ id }) => id.split('-').at(-1)));

async function pick(page, pointer, kind) {
  await page.selectOption(field(pointer), kind);
  await settled(page);
}

/** What is calculated for the design at hand, which is possible. */
async function answered(page) {
  assert.ok(await page.isHidden('#impossible'), await page.textContent('#impossible'));
  const design = await designOf(page);
  const answers = await bed.server.answers(design);
  assert.equal(await resultOf(page, 'Force, ring'), answers.sweep.peaks.ring.force_n.value);
  assert.equal(await resultOf(page, 'Ring tip radius'), answers.geometry.ring.tip_radius_mm);
  return { design, ...answers };
}

/** How the forces of each loaded tooth add up, and how far its contacts lie off its outline, over two periods and a bit. */
const balance = (page, design, { geometry, sweep }) =>
  page.evaluate(
    async (asked) => {
      const { Motion } = await import('/page/motion.js');
      const motion = new Motion(asked.design, asked.geometry, asked.sweep);
      const worst = { force: 0, outline: 0, lobes: new Set() };
      const { states } = asked.sweep;
      for (const angle of [...new Set(states.input_angle_deg)].flatMap((deg) => [deg, deg + 2 * motion.pattern.deg])) {
        for (const { tooth, zone, center, contacts, force, positionDeg } of motion.loaded(angle)) {
          const sum = { x: 0, y: 0 };
          for (const [key, { x, y }] of Object.entries(contacts)) {
            const distance = Math.hypot(center.x - x, center.y - y);
            sum.x += (force[key] * (center.x - x)) / distance;
            sum.y += (force[key] * (center.y - y)) / distance;
            const reach = key === 'carrier' ? motion.toSlotWallMm : motion.toothRadius;
            worst.outline = Math.max(worst.outline, Math.abs(distance - reach));
          }
          // A tooth that has just reached the flank is unloaded.
          if (force.ring > 0) worst.force = Math.max(worst.force, Math.hypot(sum.x, sum.y) / force.ring);
          worst.outline = Math.max(worst.outline, Math.abs(motion.positionDeg(tooth, angle) - positionDeg) % (2 * motion.halfLobeDeg - 1e-9));
          worst.lobes.add(zone);
        }
      }
      return { ...worst, lobes: worst.lobes.size };
    },
    { design, geometry, sweep },
  );

for (const [kind, fields, lobes] of [
  ['ellipse', ['semi_major_mm', 'semi_minor_mm'], 2],
  ['eccentric', ['radius_mm', 'eccentricity_mm'], 1],
  ['harmonic', ['lobes', 'mean_radius_mm', 'amplitude_mm'], 3],
  ['harmonic_path', ['lobes', 'mean_path_radius_mm', 'amplitude_mm'], 3],
]) {
  test(`wave generator ${kind} is calculated and drawn with ${lobes} lobes`, async () => {
    const page = await bed.open();
    if (kind === 'ellipse') await pick(page, WAVE_GENERATOR, 'eccentric');
    await pick(page, WAVE_GENERATOR, kind);
    assert.deepEqual(await fieldsIn(page, WAVE_GENERATOR), fields);
    if (fields.includes('lobes')) await enter(page, `${WAVE_GENERATOR}/lobes`, lobes);
    const found = await answered(page);
    assert.equal(found.design.drive.ring.teeth, 28 - lobes);
    assert.equal(found.design.drive.wave_generator.kind, kind === 'ellipse' ? undefined : kind, 'the ellipse is meant where no kind is named');
    const arcs = await page.getAttribute('#whole .zones', 'd');
    assert.equal(arcs.match(/M/g).length, lobes);
    const worst = await balance(page, found.design, found);
    assert.ok(worst.force < 2e-3, `out of balance by ${worst.force}`);
    assert.ok(worst.outline < 2e-3, `a contact ${worst.outline} mm off the tooth`);
    assert.equal(worst.lobes, lobes, 'each zone carries');
    const coloured = await page.$$eval('#whole .tooth', (teeth) => teeth.filter(({ style }) => style.fill).length);
    assert.ok(coloured > 0, 'loaded teeth are coloured');
  });
}

test('ellipse changes to kinds of equal size and back', async () => {
  const page = await bed.open();
  await pick(page, WAVE_GENERATOR, 'eccentric');
  assert.deepEqual((await designOf(page)).drive.wave_generator, { kind: 'eccentric', radius_mm: 57, eccentricity_mm: 1 });
  await pick(page, WAVE_GENERATOR, 'harmonic');
  assert.deepEqual((await designOf(page)).drive.wave_generator, { kind: 'harmonic', lobes: 2, mean_radius_mm: 57, amplitude_mm: 1 });
  await pick(page, WAVE_GENERATOR, 'harmonic_path');
  assert.deepEqual((await designOf(page)).drive.wave_generator, { kind: 'harmonic_path', lobes: 2, amplitude_mm: 1, mean_path_radius_mm: 62 });
  await pick(page, WAVE_GENERATOR, 'ellipse');
  const { drive } = await designOf(page);
  assert.deepEqual([drive.wave_generator, drive.ring.teeth], [{ semi_major_mm: 58, semi_minor_mm: 56 }, 26]);
});

test('ring with more teeth stays so with other lobes', async () => {
  const page = await bed.open();
  await choose(page, 'ring-with-more-teeth');
  const { drive: before } = await designOf(page);
  assert.equal(before.ring.teeth, before.teeth.count + 2);
  await pick(page, WAVE_GENERATOR, 'eccentric');
  assert.equal((await designOf(page)).drive.ring.teeth, before.teeth.count + 1);
});

test('unlike zones count all teeth, each on its lobe', async () => {
  const page = await bed.open();
  await pick(page, WAVE_GENERATOR, 'harmonic');
  await enter(page, `${WAVE_GENERATOR}/lobes`, 3);
  const found = await answered(page);
  assert.ok(found.sweep.states.lobe, '28 slots have no third');
  assert.equal(await resultOf(page, 'Most teeth in mesh, all zones'), found.coincidence.teeth_in_mesh_per_zone.max);
  const worst = await balance(page, found.design, found);
  assert.equal(worst.lobes, 3);
  assert.ok(worst.force < 2e-3 && worst.outline < 2e-3, JSON.stringify(worst));
  // One curve: a tooth's load depends only on its place.
  const { positions, breaks } = await page.evaluate(
    async ({ design, sweep }) => {
      const { passOf } = await import('/page/pass.js');
      const pass = passOf(design, sweep);
      return { positions: pass.position, breaks: pass.breaks.size };
    },
    found,
  );
  positions.forEach((deg, index) => assert.ok(index === 0 || deg < positions[index - 1] - 1e-9));
  assert.equal(breaks, 0, 'nothing jumps');
  // With a slot count divisible by three, one zone represents all.
  await enter(page, `${TEETH}/installed`, '');
  await enter(page, `${TEETH}/count`, 30);
  await enter(page, '/drive/ring/teeth', 27);
  assert.equal((await answered(page)).sweep.states.lobe, undefined);
  assert.ok((await resultOf(page, 'Most teeth in mesh, each zone')) > 0);
});

test('ratio steps follow the number of lobes', async () => {
  const page = await bed.open();
  const counts = async (ratio) => {
    await page.fill(field('/ratio'), ratio);
    await page.keyboard.press('Enter');
    await settled(page);
    const { drive } = await designOf(page);
    return [drive.teeth.count, drive.ring.teeth];
  };
  assert.deepEqual(await counts('14.5'), [29, 27]);
  await pick(page, WAVE_GENERATOR, 'harmonic');
  await enter(page, `${WAVE_GENERATOR}/lobes`, 3);
  assert.equal(await page.inputValue(field('/ratio')), '9.66667');
  assert.deepEqual(await counts('9.333'), [28, 25]);
});

for (const [shape, fields] of [
  ['cylinder', ['width_mm', 'count', 'installed']],
  ['ball', ['wave_generator', 'ring', 'carrier', 'count', 'installed']],
  ['flat_sided', ['width_mm', 'flat_length_mm', 'count', 'installed']],
]) {
  test(`teeth ${shape} have own fields, are calculated and drawn`, async () => {
    const page = await bed.open();
    if (shape === 'cylinder') await pick(page, TEETH, 'ball');
    await pick(page, TEETH, shape);
    assert.deepEqual(await fieldsIn(page, TEETH), ['radius_mm', ...fields]);
    const found = await answered(page);
    assert.equal(found.design.drive.teeth.shape, shape === 'cylinder' ? undefined : shape, 'cylinders are meant where no shape is named');
    const laws = await page.$$eval(`${field(LAW)} option`, (options) => options.filter(({ hidden }) => !hidden).map(({ value }) => value));
    const ofLines = Object.keys(KINDS[LAW]).filter((law) => law !== 'hertz').toSorted();
    assert.deepEqual(laws.toSorted(), shape === 'ball' ? ['fixed', 'hertz'] : ofLines);
    const worst = await balance(page, found.design, found);
    assert.ok(worst.force < 2e-3 && worst.outline < 2e-3, JSON.stringify(worst));
    const tags = await page.$$eval('#whole .tooth', (teeth) => [...new Set(teeth.map(({ tagName }) => tagName))]);
    assert.deepEqual(tags, [shape === 'flat_sided' ? 'path' : 'circle']);
    // Slot width follows from the tooth's part at its walls.
    const corner = found.geometry.carrier.finger.corners.y_mm[0];
    assert.ok(Math.abs(corner - Math.sqrt(25 - (found.design.drive.teeth.flat_length_mm ?? 0) ** 2 / 4)) < 1e-9);
    if (shape === 'ball') {
      assert.equal(found.design.model.compatibility, 'virtual_work', 'Hertz’s law wants it');
      assert.equal(await resultOf(page, 'Half-length of the contact, along the axis, ring'), found.sweep.peaks.ring.half_length_mm);
      await enter(page, `${TEETH}/groove_radius_mm/ring`, 5.2);
      const grooved = await answered(page);
      assert.deepEqual(grooved.design.drive.teeth.groove_radius_mm, { ring: 5.2 });
      assert.ok(grooved.sweep.peaks.ring.stress_mpa.value < found.sweep.peaks.ring.stress_mpa.value, 'a groove holds a ball closer');
      await enter(page, `${TEETH}/groove_radius_mm/ring`, '');
      assert.equal((await designOf(page)).drive.teeth.groove_radius_mm, undefined);
    }
  });
}

for (const [law, fields, pointer, value] of [
  ['linear', []],
  ['palmgren', []],
  ['johnson', ['wave_generator', 'ring', 'carrier'], `${LAW}/depth_mm/ring`, 8],
  ['fixed', ['wave_generator_n_per_mm', 'ring_n_per_mm', 'carrier_n_per_mm'], `${LAW}/ring_n_per_mm`, 400000],
]) {
  test(`contact law ${law} has own fields, which change answer`, async () => {
    const page = await bed.open();
    await pick(page, '/model/compatibility', 'virtual_work');
    await pick(page, LAW, law === 'linear' ? 'johnson' : law);
    await pick(page, LAW, law);
    await page.evaluate(() => document.querySelectorAll('#form details').forEach((group) => (group.open = true)));
    assert.deepEqual(await fieldsIn(page, LAW), fields);
    const before = await answered(page);
    assert.equal(before.design.model.stiffness.law, law);
    if (!pointer) return;
    await enter(page, pointer, value);
    const after = await answered(page);
    assert.notEqual(after.sweep.peaks.ring.force_n.value, before.sweep.peaks.ring.force_n.value);
  });
}

test('choosing projection or Johnson’s law keeps design possible', async () => {
  const page = await bed.open();
  await pick(page, '/model/compatibility', 'projection');
  await pick(page, LAW, 'johnson');
  assert.equal((await answered(page)).design.model.compatibility, 'virtual_work');
  await pick(page, '/model/compatibility', 'projection');
  assert.equal((await answered(page)).design.model.stiffness.law, 'linear');
});

test('document without model shows the service’s model', async () => {
  const page = await bed.open();
  const { model, ...unnamed } = await designOf(page);
  assert.ok(model, 'the paper’s examples name theirs');
  for (const [design, compatibility, law] of [
    [unnamed, 'virtual_work', 'johnson'],
    [{ ...unnamed, model: { compatibility: 'projection' } }, 'projection', 'linear'],
    [{ ...unnamed, drive: { ...unnamed.drive, teeth: { shape: 'ball', count: 28, radius_mm: 5 } } }, 'virtual_work', 'hertz'],
  ]) {
    await setDocument(page, design);
    assert.deepEqual([await page.inputValue(field('/model/compatibility')), await page.inputValue(field(LAW))], [compatibility, law]);
    const found = await answered(page);
    assert.deepEqual(found.design, design);
    const named = await bed.server.answers({ ...design, model: { compatibility, stiffness: { law } } });
    assert.deepEqual(named.sweep, found.sweep);
  }
});

test('peaks state their model error', async () => {
  const page = await bed.open();
  const told = () => page.$$eval('#table .told', (lines) => lines.map((line) => line.textContent));
  // The paper's model, whose forces are too large, without wind-up.
  const estimated = 'Estimated from the parts as they are made. Forces leave it out until you take it over.';
  assert.deepEqual(await told(), ['The model’s own error: force +1 to +8\u202f%, stress −1 to +5\u202f%. It was not measured for other sizes and loads under its law.', '', '', estimated]);
  const { model, ...unnamed } = await designOf(page);
  assert.ok(model);
  const carrier = { fingers: 'held_at_both_ends' };
  await setDocument(page, { ...unnamed, parts: { carrier }, sweep: { wind_up: true } });
  assert.deepEqual(await told(), [
    'The model’s own error: force −1 to 0\u202f%, stress −2 to +1\u202f%.',
    '',
    'The model’s own error: wind-up −2 to −1\u202f%, with bodies that are rigid below the depth of the contact law. ' +
      'Besides, for a housed rim and stiff fingers: by the estimates −12 %, −25 to −20\u202f% in earlier calculations of elastic bodies.',
    estimated,
  ]);
  await setDocument(page, { ...unnamed, parts: { carrier, ring: { clearance_um: 20 } } });
  assert.match((await told())[0], /It was not measured for larger clearances, a larger wind-up\.$/);
  await pick(page, LAW, 'fixed');
  assert.equal((await told())[0], 'The model’s own error: not measured under this law.');
});

test('service’s choices can be overridden in the form', async () => {
  const page = await bed.open();
  const { model: _, ...unnamed } = await bed.server.example('paper-5.2');
  await setDocument(page, unnamed);
  await page.click('summary:has-text("Compliance of the supports")');
  const before = await answered(page);
  const place = '/model/refinements';
  assert.equal(await page.inputValue(field(place)), '');
  await pick(page, place, 'none');
  const denied = await answered(page);
  assert.equal(denied.design.model.refinements, 'none');
  assert.notEqual(denied.sweep.peaks.ring.force_n.value, before.sweep.peaks.ring.force_n.value);
  await pick(page, place, 'ring_teeth_bend');
  const named = await answered(page);
  assert.deepEqual(named.design.model.refinements, ['ring_teeth_bend']);
  assert.equal(named.sweep.peaks.ring.force_n.value, before.sweep.peaks.ring.force_n.value);
  await pick(page, place, '');
  assert.equal((await designOf(page)).model?.refinements, undefined);
  await setDocument(page, { ...unnamed, model: { refinements: 'none' } });
  assert.equal(await page.inputValue(field(place)), 'none');
});

test('old document is converted with a notice', async () => {
  const page = await bed.open();
  const { model: _, ...unnamed } = await bed.server.example('paper-5.2');
  const old = { ...unnamed, model: { clearance: { ring_um: 10 }, corner_contact: true } };
  const converted = { ...unnamed, model: { refinements: ['auto', 'corner_contact'] }, parts: { ring: { clearance_um: 10 } } };
  await setDocument(page, old);
  assert.deepEqual(await designOf(page), converted);
  assert.match(await page.textContent('#notice-text'), /earlier version/);
});

test('series compliance changes the answer', async () => {
  const page = await bed.open();
  await pick(page, '/model/compatibility', 'virtual_work');
  const before = await answered(page);
  await page.click('summary:has-text("Compliance of the supports")');
  await enter(page, '/model/series_compliance_mm_per_n/ring', '1e-6');
  const after = await answered(page);
  assert.deepEqual(after.design.model.series_compliance_mm_per_n, { ring: 1e-6 });
  assert.notEqual(after.sweep.peaks.ring.force_n.value, before.sweep.peaks.ring.force_n.value);
});

test('button takes the compliance estimates into the design', async () => {
  const page = await bed.open();
  await setDocument(page, { drive: (await designOf(page)).drive, load: { input_torque_nm: 20 }, parts: { carrier: { fingers: 'held_at_one_end' } } });
  const before = await answered(page);
  assert.ok(before.sweep.findings.some(({ code }) => code === 'slender_fingers'));
  await page.click('#more');
  await page.click('button[aria-label="Finger held at one end: take over as series compliance"]');
  await settled(page);
  const after = await answered(page);
  assert.equal(after.design.model.series_compliance_mm_per_n, 'estimated');
  assert.ok(!after.sweep.findings.some(({ code }) => code === 'slender_fingers'));
  assert.ok(after.sweep.peaks.carrier.force_n.value < before.sweep.peaks.carrier.force_n.value);
  // The choice of fingers can be removed.
  await page.click('summary:has-text("Parts as they are made")');
  await pick(page, '/parts/carrier/fingers', '');
  assert.ok(!('fingers' in ((await answered(page)).design.parts?.carrier ?? {})));
});

test('copying an estimate replaces the paper’s model', async () => {
  const page = await bed.open();
  await setDocument(page, { drive: (await designOf(page)).drive, load: { input_torque_nm: 20 }, model: { compatibility: 'projection', stiffness: { law: 'linear' } } });
  await answered(page);
  await page.click('#more');
  await page.click('button[aria-label$="take over as series compliance"] >> visible=true');
  await settled(page);
  const { design, sweep } = await answered(page);
  assert.equal(design.model.compatibility, 'virtual_work');
  assert.equal(design.model.stiffness.law, 'linear');
  assert.ok(sweep.peaks.ring.force_n.value > 0);
});

test('comparison lists stresses by contact and deviations', async () => {
  const page = await bed.open();
  const load = { input_torque_nm: 20 };
  const { drive } = await designOf(page);
  await setDocument(page, { drive, load });
  await answered(page);
  await page.click('#keep');
  const tooth_radius_um = [...Array(27).fill(0), 2.5];
  await setDocument(page, { drive, load: { ...load, allowable_stress_mpa: { wave_generator: 1400, ring: 950, carrier: 1300 } }, deviations: { tooth_radius_um } });
  await answered(page);
  const told = (await page.textContent('#differing')).replaceAll(/[\u00a0\u202f]/g, ' ');
  assert.match(told, /Allowable stress – → wave generator 1400 MPa, ring 950 MPa, carrier 1300 MPa/);
  assert.match(told, /Teeth thinner in radius, each – → 28, 0 to 2.5 µm/);
});

test('document with explicit kinds opens in form and link', async () => {
  const design = {
    drive: {
      wave_generator: { kind: 'eccentric', radius_mm: 30.8, eccentricity_mm: 1.2 },
      teeth: { shape: 'ball', count: 20, radius_mm: 2.5, groove_radius_mm: { ring: 2.6 } },
      ring: { teeth: 19 },
    },
    load: { input_torque_nm: 1 },
    model: { compatibility: 'virtual_work', stiffness: { law: 'hertz' } },
  };
  let page = await bed.open();
  await setDocument(page, design);
  assert.deepEqual((await answered(page)).design, design);
  for (const [pointer, kind] of [[WAVE_GENERATOR, 'eccentric'], [TEETH, 'ball'], [LAW, 'hertz']]) assert.equal(await page.inputValue(field(pointer)), kind);
  await pressInMenu(page, '#copy-link');
  const address = await page.evaluate(() => location.hash);
  await page.context().close();
  page = await bed.open({ address });
  assert.deepEqual((await answered(page)).design, design);
});

/** Values that a design may have, by pointer, each with the schema that it has; a list is one value. */
function* valuesOf(schemas, schema, pointer = '') {
  if (schema.$ref) yield* valuesOf(schemas, schemas[schema.$ref.split('/').at(-1)], pointer);
  else if (schema.oneOf ?? schema.allOf) for (const option of schema.oneOf ?? schema.allOf) yield* valuesOf(schemas, option, pointer);
  else if (schema.properties) for (const [name, inner] of Object.entries(schema.properties)) yield* valuesOf(schemas, inner, `${pointer}/${name}`);
  else if (schema.type !== 'null') yield { pointer, schema };
}

// Values without a field on the page, with the reason. The JSON view has them.
const NOT_IN_THE_FORM = {
  '/accuracy/requested_error': 'chosen where accuracy is measured',
  '/assembly/input_angle_deg': 'turned in the picture',
  '/model/series_compliance_mm_per_n': 'the word for all estimates; each number has a field',
  ...Object.fromEntries(['yield_strength_mpa', 'tensile_strength_mpa', 'endurance_limit_mpa', 'hardened'].map((name) => [`/parts/carrier/strength/${name}`, 'a material by name has a field'])),
  ...Object.fromEntries(['wave_generator', 'ring', 'carrier'].map((contact) => [`/load/allowable_stress_mpa/${contact}`, 'one for all has a field'])),
  ...Object.fromEntries(
    ['clearance/wave_generator_um', 'clearance/ring_um', 'clearance/carrier_um', 'ring_teeth_bend', 'wave_generator_moves', 'corner_contact'].map((field) => [`/model/${field}`, 'deprecated: the page converts it']),
  ),
  ...Object.fromEntries(
    ['tooth_radius_um', 'slot_angle_arcsec', 'slot_wall_um', 'ring_space_um', 'ring_space_angle_arcsec', 'wave_generator_lobe_um'].map((list) => [`/deviations/${list}`, 'a list, measured and not typed']),
  ),
};

test('fields match the API document, with listed exceptions', async () => {
  const page = await bed.open();
  const { schemas } = (await (await fetch(`${bed.server.origin}/openapi.json`)).json()).components;
  const known = new Set([...valuesOf(schemas, schemas.Design)].map(({ pointer }) => pointer));
  const shown = await page.evaluate(async () => {
    const [{ GROUPS }, { fieldsOf }] = await Promise.all([import('/page/fields.js'), import('/page/field.js')]);
    return GROUPS.flatMap(fieldsOf).map(({ pointer, tag, kind, starts }) => ({ pointer: tag ? `${pointer}/${tag}` : pointer, isValue: kind !== 'oneOf' && starts === undefined && !pointer.startsWith('/ratio') }));
  });
  const fields = new Set(shown.filter(({ isValue }) => isValue).map(({ pointer }) => pointer));
  assert.deepEqual([...known].filter((pointer) => !fields.has(pointer) && !(pointer in NOT_IN_THE_FORM)), []);
  assert.deepEqual([...fields].filter((pointer) => !known.has(pointer)), []);
  assert.deepEqual(Object.keys(NOT_IN_THE_FORM).filter((pointer) => !known.has(pointer) || fields.has(pointer)), []);
});

test('a kind without an entry has its fields by their names', async () => {
  const { nameOf, variant } = await import('../../src/service/page/field.js');
  const [, ...others] = variant(WAVE_GENERATOR, 'kind', [{ value: 'ellipse', fields: [] }]).options;
  const path = others.find(({ value }) => value === 'harmonic_path');
  assert.deepEqual(path.fields.map(({ pointer, whole, unit }) => [pointer.split('/').at(-1), whole, unit]), [['amplitude_mm', false, 'mm'], ['lobes', true, ''], ['mean_path_radius_mm', false, 'mm']]);
  assert.deepEqual(nameOf(`${WAVE_GENERATOR}/mean_path_radius_mm`, 2), { label: 'Mean path radius', unit: 'mm' });
});

test('every kind can be chosen and has its fields', async () => {
  const page = await bed.open();
  const { schemas } = (await (await fetch(`${bed.server.origin}/openapi.json`)).json()).components;
  const variants = await page.evaluate(async () => {
    const [{ GROUPS }, { fieldsOf }] = await Promise.all([import('/page/fields.js'), import('/page/field.js')]);
    const options = ({ options, pointer }) => Object.fromEntries(options.filter(({ value }) => value !== 'none').map(({ value, fields }) => [value, fields.map((field) => field.pointer).filter((inner) => inner.startsWith(`${pointer}/`))]));
    return Object.fromEntries(GROUPS.flatMap(fieldsOf).filter(({ kind }) => kind === 'variant').map((field) => [field.pointer, options(field)]));
  });
  for (const [union, place, propertyName, common] of [
    ['WaveGenerator', WAVE_GENERATOR, 'kind', []],
    ['Teeth', TEETH, 'shape', ['count', 'installed', 'radius_mm']],
    ['Stiffness', LAW, 'law', []],
    ['WaveGeneratorFriction', '/friction/wave_generator', 'kind', []],
  ]) {
    const mapping = Object.fromEntries(schemas[union].oneOf.map(({ $ref }) => [schemas[$ref.split('/').pop()].properties[propertyName].enum[0], $ref]));
    assert.deepEqual(Object.keys(variants[place]).toSorted(), Object.keys(mapping).toSorted());
    for (const [word, reference] of Object.entries(mapping)) {
      const own = [...valuesOf(schemas, { $ref: reference }, place)].map(({ pointer }) => pointer);
      // The coefficient of a race without rubbing has no effect.
      const unshown = word === 'rolling' ? ['coefficient'] : [];
      const expected = own.filter((pointer) => ![propertyName, ...common, ...unshown].includes(pointer.slice(place.length + 1)));
      assert.deepEqual(variants[place][word].toSorted(), expected.toSorted(), `${union} ${word}`);
    }
  }
});

test('modification fields change the answer and choose virtual work', async () => {
  const page = await bed.open();
  await page.evaluate(() => document.querySelectorAll('#form details').forEach((group) => (group.open = true)));
  await enter(page, '/parts/ring/clearance_um', 20);
  // A turned part gives only lost motion, which changes the wind-up but no force.
  await page.check(field('/sweep/wind_up'));
  await enter(page, '/modification/ring_equidistant_um', 4);
  let found = await answered(page);
  assert.deepEqual(found.design.model, { compatibility: 'virtual_work', stiffness: { law: 'linear' } }, 'the law stays');
  for (const name of ['ring_path_shift_um', 'ring_profile_shift_um', 'ring_rotation_arcsec', 'wave_generator_equidistant_um', 'slot_wall_um', 'carrier_rotation_arcsec', 'tooth_radius_um']) {
    const before = found.sweep;
    await enter(page, `/modification/${name}`, 2);
    found = await answered(page);
    assert.equal(found.design.modification[name], 2);
    assert.notDeepEqual(found.sweep, before, name);
  }
  await page.check(field('/modification/ring_tip_relief'));
  await settled(page);
  const relieved = await answered(page);
  assert.deepEqual(relieved.design.modification.ring_tip_relief, { amount_um: 5, start_deg: 60, power: 2 });
  // With these gaps no tooth carries beyond 60°.
  await enter(page, '/modification/ring_tip_relief/start_deg', 20);
  assert.notDeepEqual((await answered(page)).sweep.states.force_ring_n, found.sweep.states.force_ring_n);
  await page.uncheck(field('/modification/ring_tip_relief'));
  await settled(page);
  assert.ok(await page.isHidden(field('/modification/ring_tip_relief/power')));
  assert.deepEqual((await designOf(page)).modification, found.design.modification);
  // An interference is reported in the service's words.
  await enter(page, '/modification/tooth_radius_um', -400);
  assert.match(await page.textContent('#impossible'), /interfere/i);
});

test('form has runouts and counts lists in JSON', async () => {
  const page = await bed.open();
  await page.evaluate(() => document.querySelectorAll('#form details').forEach((group) => (group.open = true)));
  await enter(page, '/parts/ring/clearance_um', 20);
  await enter(page, '/deviations/ring_runout/amount_um', 3);
  await enter(page, '/deviations/ring_runout/angle_deg', 40);
  const found = await answered(page);
  assert.deepEqual(found.design.deviations, { ring_runout: { amount_um: 3, angle_deg: 40 } });
  assert.ok(found.sweep.sweep_period_deg > found.sweep.period_deg);
  await setDocument(page, { ...found.design, deviations: { wave_generator_lobe_um: [0, 2] } });
  assert.match(await page.locator('#form summary', { hasText: 'Runout' }).textContent(), /1 list in the JSON/);
});

test('nominal picture says so and links to drawings', async () => {
  const page = await bed.open();
  const told = page.locator('#legend .nominal');
  assert.ok(await told.isHidden());
  await choose(page, 'balls');
  assert.ok(await told.isHidden());
  const { drive, load } = await designOf(page);
  const made = { drive, load, modification: { ring_equidistant_um: 10 } };
  await setDocument(page, made);
  assert.equal(await told.textContent(), 'The picture is the nominal drive. The drawings show the modification, of micrometres, true to size.');
  // The picture's outline is that of the unmodified ring, unlike the drawing's.
  const ring = async (design) => (await bed.server.ask('/v1/drawings/ring', design)).bodies[0].holes[0];
  const outline = await page.getAttribute('#whole .part-ring', 'd');
  assert.notDeepEqual(await ring(made), await ring({ ...made, modification: {} }));
  await setDocument(page, { ...made, modification: {} });
  assert.equal(await page.getAttribute('#whole .part-ring', 'd'), outline);
  assert.ok(await told.isHidden());
  await setDocument(page, { ...made, parts: { ring: { clearance_um: 10 } }, deviations: { ring_runout: { amount_um: 2 } } });
  assert.equal(await told.textContent(), 'The picture is the nominal drive. The drawings show the modification and clearances, of micrometres, true to size. The deviations affect only the numbers.');
  await told.locator('button').click();
  assert.ok(await page.isVisible('#downloads'));
});
