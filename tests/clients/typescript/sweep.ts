// All calls by openapi-fetch: node sweep.js URL
import createClient from 'openapi-fetch';
import type { components, paths } from './api.js';

// Answers have several forms; which are wanted is said once, here.
const client = createClient<paths, 'application/json' | 'application/problem+json'>({ baseUrl: process.argv[2] });

function found<T>({ data, error }: { data?: T; error?: unknown }): T {
  if (data === undefined) throw new Error(JSON.stringify(error));
  return data;
}

function require(holds: boolean, what: string) {
  if (!holds) throw new Error(what);
}

for (const { name } of found(await client.GET('/v1/examples')).examples) {
  const body = found(await client.GET('/v1/examples/{name}', { params: { path: { name } } }));
  require(found(await client.POST('/v1/geometry', { body })).findings !== undefined, name);
  require(found(await client.POST('/v1/coincidence-degree', { body })).coincidence_degree > 0, name);
  require((found(await client.POST('/v1/design', { body })).sweep?.peaks.ring.force_n.value ?? 0) > 0, name);
  require(found(await client.POST('/v1/drawings/{part}', { params: { path: { part: 'assembly' } }, body })).bodies.length > 0, name);
}

const design: components['schemas']['Design'] = {
  drive: {
    wave_generator: { kind: 'ellipse', semi_major_mm: 58, semi_minor_mm: 56 },
    teeth: { shape: 'cylinder', count: 28, radius_mm: 5, width_mm: 15 },
    ring: { teeth: 26 },
  },
  load: { input_torque_nm: 20 },
  model: { compatibility: 'projection', stiffness: { law: 'linear' } },
};
console.log(found(await client.POST('/v1/sweep', { body: design })).peaks.wave_generator.force_n.value);
require(found(await client.POST('/v1/accuracy', { body: design })).ways.length > 0, 'no ways');

// What is refused is a problem, of the same type everywhere.
const teeth = { ...design.drive.teeth, radius_mm: -1 };
const refused = await client.POST('/v1/sweep', { body: { ...design, drive: { ...design.drive, teeth } } });
require(refused.error?.errors?.[0]?.pointer === '/drive/teeth/radius_mm', 'no problem');

// A choice is told apart by its word.
const drawing = found(await client.POST('/v1/drawings/{part}', { params: { path: { part: 'tooth' } }, body: design }));
const outline = drawing.bodies[0]?.outer;
require(outline?.kind === 'circle' && outline.radius_mm === 5, 'no circle');

require(found(await client.GET('/v1/quantities')).quantities.length > 0, 'no quantities');
const over = { '/load/input_torque_nm': { min: 1, max: 2, steps: 3 } };
const study = found(await client.POST('/v1/studies', { params: { header: { Prefer: 'wait=9' } }, body: { study: 'map', base: { ...design }, over } }));
require(study.result?.study === 'map' && study.result.variants === 3, 'no result');
const { response } = await client.DELETE('/v1/studies/{id}', { params: { path: { id: study.id } } });
require(response.status === 204, 'not deleted');
