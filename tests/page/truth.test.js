// What the drawing and the plots show between the service's states is what the service answers there.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, field, settled, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });
const EXAMPLES = ['paper-5.1', 'paper-5.2', 'ring-with-more-teeth'];

test('between two states the loads are those that the service finds there', async () => {
  const page = await bed.open();
  for (const name of EXAMPLES) {
    const worst = await page.evaluate(async (example) => {
      const { Motion } = await import('/page/motion.js');
      const { read } = await import('/page/answers.js');
      const design = await (await fetch(`/v1/examples/${example}`)).json();
      const ask = async (path, samples) =>
        read(await (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ ...design, sweep: { samples } }) })).arrayBuffer(), path.slice(4));
      const geometry = await ask('/v1/geometry', 50);
      const motion = new Motion(design, geometry, await ask('/v1/sweep', 50));
      const fine = await ask('/v1/sweep', 800);
      const { states, peaks } = fine;
      const off = { force: 0, stress: 0 };
      const missing = [];
      states.tooth.forEach((tooth, row) => {
        const angle = states.input_angle_deg[row];
        if (angle >= motion.period) return;
        const found = motion.loaded(angle).find((loaded) => loaded.zone === 0 && loaded.tooth === tooth % motion.installed);
        if (!found) {
          missing.push([angle, tooth, states.position_deg[row]]);
          return;
        }
        for (const key of ['wave_generator', 'ring', 'carrier']) {
          off.force = Math.max(off.force, Math.abs(found.force[key] - states[`force_${key}_n`][row]) / peaks[key].force_n.value);
          off.stress = Math.max(off.stress, Math.abs(found.stress[key] - states[`stress_${key}_mpa`][row]) / peaks[key].stress_mpa.value);
        }
      });
      return { ...off, missing };
    }, name);
    assert.deepEqual(worst.missing, [], name);
    // The step of 50 samples, held at a jump, is all that they are off by.
    assert.ok(worst.force < 0.012, `${name}: forces off by ${worst.force}`);
    assert.ok(worst.stress < 0.012, `${name}: stresses off by ${worst.stress}`);
  }
});

test('the wall that holds a tooth is the one that its forces press it to, in either sense', async () => {
  const page = await bed.open();
  for (const [name, wall] of [['paper-5.1', 'leading'], ['ring-with-more-teeth', 'trailing']]) {
    const { carrier } = await bed.server.ask('/v1/geometry', await bed.server.example(name));
    assert.equal(carrier.loaded_wall, wall);
    const sums = await page.evaluate(async (example) => {
      const { Motion } = await import('/page/motion.js');
      const design = await (await fetch(`/v1/examples/${example}`)).json();
      const ask = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).json();
      const motion = new Motion(design, await ask('/v1/geometry'), await ask('/v1/sweep'));
      // A tooth that has only just come to the flank carries nothing yet.
      return motion.frames.flatMap(({ angle }) => motion.loaded(angle)).filter(({ force }) => force.ring > 0).map(({ center, contacts, force }) => {
        const sum = { x: 0, y: 0 };
        for (const [key, { x, y }] of Object.entries(contacts)) {
          const distance = Math.hypot(center.x - x, center.y - y);
          sum.x += (force[key] * (center.x - x)) / distance;
          sum.y += (force[key] * (center.y - y)) / distance;
        }
        return Math.hypot(sum.x, sum.y) / force.ring;
      });
    }, name);
    assert.ok(Math.max(...sums) < 2e-3, `${name}: out of balance by ${Math.max(...sums)}`);
  }
});

test('the carrier’s outline is the service’s: fingers between cam and ring tips, walls as far from the slot’s middle as a tooth', async () => {
  const page = await bed.open();
  for (const name of EXAMPLES) {
    await choose(page, name);
    const design = await bed.server.example(name);
    const { carrier } = await bed.server.ask('/v1/geometry', design);
    const { x_mm: x, y_mm: y } = carrier.finger.corners;
    const { radius_mm: r, installed, count } = design.drive.teeth;
    const spacing = (2 * Math.PI) / (installed ?? count);
    for (const corner of [0, 1]) assert.ok(Math.abs(y[corner] - r) < 1e-12);
    // The other wall, as far from the next slot's middle.
    for (const corner of [2, 3]) assert.ok(Math.abs(x[corner] * Math.sin(spacing) - y[corner] * Math.cos(spacing) - r) < 1e-9);
    for (const [corner, radius] of [[0, carrier.inner_radius_limit_mm], [1, carrier.outer_radius_limit_mm], [2, carrier.outer_radius_limit_mm], [3, carrier.inner_radius_limit_mm]]) {
      assert.ok(Math.abs(Math.hypot(x[corner], y[corner]) - radius) < 1e-9);
    }
    const outline = await page.getAttribute('#whole .part-carrier', 'd');
    assert.equal(outline.match(/M/g).length, installed ?? count);
    assert.ok(outline.startsWith(`M${x[0].toFixed(4)} ${y[0].toFixed(4)}L${x[1].toFixed(4)} ${y[1].toFixed(4)}A`));
  }
});

test('the other shaft’s torque is the service’s, and is not made up where there is none', async () => {
  const page = await bed.open();
  const { load } = (await bed.server.answers(await bed.server.example('paper-5.1'))).sweep;
  assert.deepEqual(load, { input_torque_nm: 20, output_torque_nm: 280 });
  // A drive that is impossible has no torque at its other shaft.
  await page.fill(field('/drive/wave_generator/semi_minor_mm'), '60');
  await settled(page);
  await page.fill(field('/load/input_torque_nm'), '33');
  await settled(page);
  await page.selectOption(field('/load'), 'output_torque_nm');
  await settled(page);
  assert.equal(await page.inputValue(field('/load/output_torque_nm')), '');
  assert.match(await page.textContent('#notes-load-output_torque_nm'), /Wanted here/);
});
