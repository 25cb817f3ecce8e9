// Answers of the service, from bytes to what the page draws.

import { drawableStudy } from './grids.js';
import { drawable } from './states.js';
import { t } from './texts.js';

/** As large as an answer may be to be read at once: some milliseconds. */
const MOST_BYTES = 1 << 20;

const READERS = {
  design: (design) => ({ ...design, ...(design.sweep && { sweep: drawable(design.sweep) }) }),
  sweep: drawable,
  study: (study) => (study.result ? { ...study, result: drawableStudy(study.result) } : study),
  result: drawableStudy,
};

/** The answer in the bytes of its JSON. */
export function read(bytes, kind) {
  const answer = JSON.parse(new TextDecoder().decode(bytes));
  return READERS[kind]?.(answer) ?? answer;
}

/** The answer of a response; a large one is read by a worker. */
export async function answerOf(response, kind, signal) {
  const bytes = await response.arrayBuffer();
  if (bytes.byteLength <= MOST_BYTES) return read(bytes, kind);
  const worker = new Worker(new URL('./large.js', import.meta.url), { type: 'module' });
  const { promise, resolve, reject } = Promise.withResolvers();
  const stop = () => reject(signal.reason);
  worker.addEventListener('message', ({ data: { answer, fault } }) => (fault === undefined ? resolve(answer) : reject(new Error(fault))));
  worker.addEventListener('error', () => reject(new Error(t('service.unreadable'))));
  signal?.addEventListener('abort', stop);
  worker.postMessage({ bytes, kind }, [bytes]);
  try {
    return await promise;
  } finally {
    signal?.removeEventListener('abort', stop);
    worker.terminate();
  }
}
