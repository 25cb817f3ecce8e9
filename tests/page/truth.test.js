// Values between the service's states, as drawn and plotted, match the service's answers there.

import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { choose, field, settled, testBed } from './harness.js';

const bed = testBed({ before, after, afterEach });
const EXAMPLES = ['paper-5.1', 'paper-5.2', 'ring-with-more-teeth'];

test('loads between states match the service', async () => {
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
        if (angle >= motion.pattern.deg) return;
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
    // The only error is a step of 50 samples, held at a jump.
    assert.ok(worst.force < 0.012, `${name}: forces off by ${worst.force}`);
    assert.ok(worst.stress < 0.012, `${name}: stresses off by ${worst.stress}`);
  }
});

test('deviating teeth match the service in every turn', async () => {
  const page = await bed.open();
  const found = await page.evaluate(async () => {
    const { Motion } = await import('/page/motion.js');
    const { passOf } = await import('/page/pass.js');
    const { read } = await import('/page/answers.js');
    const ask = async (path, design) =>
      read(await (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).arrayBuffer(), path.slice(4));
    const modulo = (value, base) => ((value % base) + base) % base;
    const turned = (list, by) => list.map((_, index) => list[modulo(index + by, list.length)]);
    const some = (count, step) => Array.from({ length: count }, (_, index) => 0.7 * ((step * index) % 7));
    const drives = [
      { wave_generator: { semi_major_mm: 58, semi_minor_mm: 56 }, teeth: { count: 28, radius_mm: 5, width_mm: 15 }, ring: { teeth: 26 } },
      { wave_generator: { semi_major_mm: 40.6, semi_minor_mm: 39.4 }, teeth: { count: 30, installed: 10, radius_mm: 3, width_mm: 12 }, ring: { teeth: 32 } },
      { wave_generator: { kind: 'harmonic', lobes: 3, mean_radius_mm: 48, amplitude_mm: 1 }, teeth: { count: 28, installed: 14, radius_mm: 3, width_mm: 12 }, ring: { teeth: 25 } },
    ];
    const report = [];
    for (const drive of drives) {
      const { count, installed = count } = drive.teeth;
      const lobes = Math.abs(count - drive.ring.teeth);
      for (const deviations of [{ tooth_radius_um: some(installed, 3) }, { ring_space_um: some(drive.ring.teeth, 5) }, { tooth_radius_um: some(installed, 3), wave_generator_lobe_um: some(lobes, 2) }]) {
        const design = { drive, load: { input_torque_nm: 5 }, sweep: { samples: 4 }, deviations };
        const sweep = await ask('/v1/sweep', design);
        const motion = new Motion(design, await ask('/v1/geometry', design), sweep);
        const periods = Math.round(sweep.sweep_period_deg / sweep.period_deg);
        let [worst, teeth] = [0, 0];
        for (const on of [1, periods - 1, periods, periods + 3, 2 * periods + 1, -1, -periods - 2]) {
          // After n periods each tooth has the place of the tooth n slots before, as if items were renumbered.
          const named = Object.entries(deviations).map(([name, list]) => [name, name.startsWith('wave') ? list : turned(list, name.startsWith('ring') ? (on * count) / installed : on)]);
          const { states } = await ask('/v1/sweep', { ...design, deviations: Object.fromEntries(named) });
          const angle = states.input_angle_deg.find((deg) => deg > 0);
          const shown = motion.loaded(angle + on * sweep.period_deg + 1e-10);
          states.input_angle_deg.forEach((deg, row) => {
            if (deg !== angle) return;
            const tooth = shown.find((loaded) => loaded.tooth === modulo(states.tooth[row] + on, installed) && loaded.zone === states.lobe[row]);
            worst = Math.max(worst, Math.abs((tooth?.force.ring ?? 0) - states.force_ring_n[row]));
            teeth += 1;
          });
        }
        // The plots show the largest load of all teeth.
        const { force, stress } = passOf(design, sweep);
        const short = ['wave_generator', 'ring', 'carrier'].map((key) => Math.max(sweep.peaks[key].force_n.value - Math.max(...force[key]), sweep.peaks[key].stress_mpa.value - Math.max(...stress[key])));
        report.push({ worst, teeth, short: Math.max(...short) });
      }
    }
    return report;
  });
  assert.equal(found.length, 9);
  for (const { worst, teeth, short } of found) {
    assert.ok(teeth > 20 && worst < 1e-6, `${worst} N off, of ${teeth} teeth`);
    assert.ok(Math.abs(short) < 1e-9, `the plots end ${short} below the peaks`);
  }
});

test('holding wall balances the forces of its tooth', async () => {
  const page = await bed.open();
  for (const [name, wall] of [['paper-5.1', 'leading'], ['ring-with-more-teeth', 'trailing']]) {
    const { carrier } = await bed.server.ask('/v1/geometry', await bed.server.example(name));
    assert.equal(carrier.loaded_wall, wall);
    const sums = await page.evaluate(async (example) => {
      const { Motion } = await import('/page/motion.js');
      const design = await (await fetch(`/v1/examples/${example}`)).json();
      const ask = async (path) => (await fetch(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(design) })).json();
      const motion = new Motion(design, await ask('/v1/geometry'), await ask('/v1/sweep'));
      // A tooth that has just reached the flank is unloaded.
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

test('carrier’s outline is that of the service', async () => {
  const page = await bed.open();
  for (const name of EXAMPLES) {
    await choose(page, name);
    const design = await bed.server.example(name);
    const { carrier } = await bed.server.ask('/v1/geometry', design);
    const { x_mm: x, y_mm: y } = carrier.finger.corners;
    const { radius_mm: r, installed, count } = design.drive.teeth;
    const spacing = (2 * Math.PI) / (installed ?? count);
    for (const corner of [0, 1]) assert.ok(Math.abs(y[corner] - r) < 1e-12);
    // The other wall, equally far from the next slot's middle.
    for (const corner of [2, 3]) assert.ok(Math.abs(x[corner] * Math.sin(spacing) - y[corner] * Math.cos(spacing) - r) < 1e-9);
    for (const [corner, radius] of [[0, carrier.inner_radius_limit_mm], [1, carrier.outer_radius_limit_mm], [2, carrier.outer_radius_limit_mm], [3, carrier.inner_radius_limit_mm]]) {
      assert.ok(Math.abs(Math.hypot(x[corner], y[corner]) - radius) < 1e-9);
    }
    const outline = await page.getAttribute('#whole .part-carrier', 'd');
    assert.equal(outline.match(/M/g).length, installed ?? count);
    assert.ok(outline.startsWith(`M${x[0].toFixed(4)} ${y[0].toFixed(4)}L${x[1].toFixed(4)} ${y[1].toFixed(4)}A`));
  }
});

test('other shaft’s torque comes from the service', async () => {
  const page = await bed.open();
  const { load } = (await bed.server.answers(await bed.server.example('paper-5.1'))).sweep;
  assert.deepEqual(load, { input_torque_nm: 20, output_torque_nm: 280 });
  // An impossible drive has no torque at its other shaft.
  await page.fill(field('/drive/wave_generator/semi_minor_mm'), '60');
  await settled(page);
  await page.fill(field('/load/input_torque_nm'), '33');
  await settled(page);
  await page.selectOption(field('/load'), 'output_torque_nm');
  await settled(page);
  assert.equal(await page.inputValue(field('/load/output_torque_nm')), '');
  assert.match(await page.textContent('#notes-load-output_torque_nm'), /Required:/);
});
