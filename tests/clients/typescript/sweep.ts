// A sweep of case 5.1: node sweep.js URL
import createClient from 'openapi-fetch';
import type { components, paths } from './api.js';

// Answers have several forms; which are wanted is said once, here.
const client = createClient<paths, 'application/json' | 'application/problem+json'>({ baseUrl: process.argv[2] });

const design: components['schemas']['Design'] = {
  drive: {
    wave_generator: { kind: 'ellipse', semi_major_mm: 58, semi_minor_mm: 56 },
    teeth: { shape: 'cylinder', count: 28, radius_mm: 5, width_mm: 15 },
    ring: { teeth: 26 },
  },
  load: { input_torque_nm: 20 },
  model: { compatibility: 'projection', stiffness: { law: 'linear' } },
};

const { data } = await client.POST('/v1/sweep', { body: design });
if (!data) throw new Error('no answer');
console.log(data.peaks.wave_generator.force_n.value);

// What is refused is a problem, of the same type everywhere.
const teeth = { ...design.drive.teeth, radius_mm: -1 };
const refused = await client.POST('/v1/sweep', { body: { ...design, drive: { ...design.drive, teeth } } });
if (refused.error?.errors?.[0]?.pointer !== '/drive/teeth/radius_mm') throw new Error('no problem');

// A choice is told apart by its word.
const drawing = await client.POST('/v1/drawings/{part}', { params: { path: { part: 'tooth' } }, body: design });
const outline = drawing.data?.bodies[0]?.outer;
if (outline?.kind !== 'circle' || outline.radius_mm !== 5) throw new Error('no circle');
