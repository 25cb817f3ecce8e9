// A sweep as it is drawn: of very many input angles those that can be told apart on a screen, and what the others leave behind.

import { CONTACTS, enteringBetween, framesOf } from './motion.js';

/** Most states that are drawn as they are: two plots with some thousands of points each. */
const MOST_STATES = 6000;

/** The sweep whose states have, at each contact, the stress times the slip: pressure times velocity but for the speed. */
function withRubbing(sweep) {
  const { states, losses } = sweep;
  if (!losses) return sweep;
  const rubbing = CONTACTS.map(({ key }) => {
    const slip = losses.slip_mm_per_rad[key];
    return [`rubbing_${key}`, states[`stress_${key}_mpa`].map((stress, row) => stress * Math.abs(slip[row]))];
  });
  // The columns that these were made of are drawn no further.
  const { slip_mm_per_rad: _, rolls: __, ...others } = losses;
  return { ...sweep, states: { ...states, ...Object.fromEntries(rubbing) }, losses: others };
}

/** The sweep with so few states that they can be drawn: every so many input angles, both sides of each jump,
 *  and the angles of the peaks. What the table shows stays that of all states. */
export function drawable(answer) {
  const sweep = withRubbing(answer);
  const { states, peaks } = sweep;
  const frames = framesOf(states);
  const stride = Math.ceil(states.tooth.length / MOST_STATES);
  if (stride <= 1) return sweep;
  const last = frames.length - 1;
  const peakAngles = new Set(Object.values(peaks).flatMap(({ force_n: force, stress_mpa: stress }) => [force.input_angle_deg, stress.input_angle_deg]));
  for (const { input_angle_deg: angle } of Object.values(sweep.losses?.pressure_velocity_mpa_m_per_s ?? {})) peakAngles.add(angle);
  const kept = new Set([0, last]);
  for (let index = 0; index < last; index += 1) {
    if (index % stride === 0 || peakAngles.has(frames[index].angle)) kept.add(index);
    // Only where a tooth number appears that was not there can loads jump; where zones are unlike it need not be the highest.
    const isNewest = states.lobe !== undefined || states.tooth[frames[index + 1].end - 1] > states.tooth[frames[index].end - 1];
    if (isNewest && enteringBetween(sweep, frames[index], frames[index + 1])) kept.add(index).add(index + 1);
  }
  const rowsOf = ({ start, end }) => Array.from({ length: end - start }, (_, row) => start + row);
  const rows = [...kept].sort((one, other) => one - other).flatMap((index) => rowsOf(frames[index]));
  const thinned = Object.fromEntries(Object.entries(states).map(([name, column]) => [name, rows.map((row) => column[row])]));
  return { ...sweep, states: thinned };
}
