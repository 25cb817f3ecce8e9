// The client of studies: one question about many variants, which the service works on while its progress is shown.

import { request } from './access.js';
import { answerOf } from './answers.js';
import { t } from './texts.js';
import { problemInWords } from './words.js';

const JSON_TYPE = 'application/json';
/** Between two looks at how a study stands. */
const LOOK_MS = 250;
/** A service that is full is asked again so often. */
const MOST_ATTEMPTS = 20;

function pause(ms, signal) {
  return new Promise((resolve, reject) => {
    const stop = () => {
      clearTimeout(timer);
      reject(signal.reason);
    };
    const timer = setTimeout(() => {
      signal?.removeEventListener('abort', stop);
      resolve();
    }, ms);
    signal?.addEventListener('abort', stop, { once: true });
  });
}

/** One reply: `{ answer }` or `{ problem }`. Where the service is full `onFull(detail)` is told, and it is asked again. What begins a study
 *  `isAwaited` even when nobody wants it any more: only its reply says what to stop. */
async function send(path, { signal, kind, onFull, isAwaited = false, ...options } = {}) {
  const during = isAwaited ? undefined : signal;
  for (let attempt = 1; ; attempt += 1) {
    let response;
    let body;
    try {
      response = await request(path, { ...options, signal: during });
      body = await answerOf(response, response.ok ? kind : undefined, during);
    } catch (error) {
      if (signal?.aborted) throw error;
      return { problem: { title: t('service.silent'), detail: t('service.ask_again'), errors: [] } };
    }
    if (response.ok) return { answer: body };
    if (response.status !== 503 || attempt === MOST_ATTEMPTS) return { problem: problemInWords(body) };
    onFull?.(problemInWords(body).detail);
    await pause(1000 * Number(response.headers.get('retry-after') ?? 1), signal);
  }
}

/** Stops a study that nobody waits for any more; one that is not kept is stopped already. */
const stop = (id) => request(`v1/studies/${id}`, { method: 'DELETE' }).catch(() => undefined);

/** A study under way. */
export class Run {
  #controller = new AbortController();
  #id;
  #isOver = false;
  #isCancelled = false;

  /** Whether somebody else's question has taken its place. */
  get isGivenUp() {
    return this.#controller.signal.aborted;
  }

  /** Begins a study and follows it: `{ answer, state, problem }`, `answer` as far as it has come, without one where it was refused.
   *  `onProgress({ variants, lookedAt, full })` while it runs. */
  async follow(question, onProgress) {
    const { signal } = this.#controller;
    const onFull = (detail) => onProgress?.({ full: detail });
    let reply = await send('v1/studies', {
      method: 'POST',
      headers: { 'content-type': JSON_TYPE, accept: JSON_TYPE, prefer: 'wait=1' },
      body: JSON.stringify(question),
      signal,
      kind: 'study',
      onFull,
      isAwaited: true,
    });
    this.#id = reply.answer?.id;
    if (reply.answer?.state === 'running' && (this.isGivenUp || this.#isCancelled)) await stop(this.#id);
    signal.throwIfAborted();
    while (reply.answer?.state === 'running') {
      const { id, variants, looked_at: lookedAt } = reply.answer;
      // The best are looked at once more, and nobody knows how many these will be.
      onProgress?.({ variants, lookedAt: Math.min(lookedAt, variants) });
      await pause(LOOK_MS, signal);
      reply = await send(`v1/studies/${id}`, { signal, kind: 'study', onFull });
    }
    this.#isOver = true;
    if (reply.problem) return { problem: reply.problem };
    const { state, problem, result, result_href: href } = reply.answer;
    const { answer = result, problem: lost } = result ? {} : await send(href.slice(1), { headers: { accept: JSON_TYPE }, signal, kind: 'result', onFull });
    return { answer, state, problem: problem ? problemInWords(problem) : lost };
  }

  /** Ends it early: what it has come to is its answer. */
  cancel() {
    this.#isCancelled = true;
    if (this.#id !== undefined && !this.#isOver) stop(this.#id);
  }

  /** Nobody waits for it any more; `follow` then throws. */
  giveUp() {
    if (this.#id !== undefined && !this.#isOver) stop(this.#id);
    this.#controller.abort();
  }
}
