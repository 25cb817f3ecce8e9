// The client of the calculation service: the newest design wins, stale requests are aborted, and a service that went away is
// asked again until it answers.

import { isAsking, request } from './access.js';
import { answerOf } from './answers.js';
import { t } from './texts.js';
import { problemInWords } from './words.js';

/** A running evaluation is left to finish although a newer design waits, unless it takes much longer than the last one took:
 *  a dragged slider then shows every answer that it can get, instead of aborting each one just before it arrives. */
const GRACE = 2;
const LEAST_GRACE_MS = 80;
const MOST_GRACE_MS = 1000;
const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 5000;
const HEARTBEAT_MS = 5000;

/** A calculation that takes longer than this is told of; after the second time the service is asked whether it lives, and gets the
 *  third to say so. */
const SLOW_MS = 1000;
const SUSPICIOUS_MS = 3000;
const ALIVE_MS = 2000;
const MOST_PATIENCE_MS = 48_000;

/** Whether the process answers at all, within its time. */
const isAlive = () =>
  fetch('health/live', { cache: 'no-store', signal: AbortSignal.timeout(ALIVE_MS) }).then(
    () => true,
    () => false,
  );

/** The service cannot be reached, or is too busy to answer. */
class Unavailable extends Error {
  constructor(message, retryMs) {
    super(message);
    this.retryMs = retryMs;
  }
}

const JSON_TYPE = 'application/json';

/** One answer, or the problem in its place; anything but JSON is answered as a `Blob`. `kind` says how an answer is read. */
export async function ask(path, design, { signal, accept = JSON_TYPE, kind } = {}) {
  let response;
  let body;
  try {
    response = await request(path, {
      method: 'POST',
      headers: { 'content-type': JSON_TYPE, accept },
      body: JSON.stringify(design),
      signal,
    });
    body = await (response.ok && accept !== JSON_TYPE ? response.blob() : answerOf(response, response.ok ? kind : undefined, signal));
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Unavailable(t('service.silent'));
  }
  if (response.status === 503) {
    throw new Unavailable(problemInWords(body).detail, 1000 * Number(response.headers.get('retry-after') ?? 1));
  }
  if (!response.ok) return { problem: problemInWords(body) };
  const solve = /dur=([\d.]+)/.exec(response.headers.get('server-timing') ?? '');
  return { answer: body, solveMs: solve ? Number(solve[1]) : undefined };
}

/** Whether the meshing zones are alike, so that the service answers about one of them: each lobe has as many slots. */
function zonesOf({ drive }) {
  const lobes = Math.abs(drive?.teeth?.count - drive?.ring?.teeth);
  return { areAlike: !((drive?.teeth?.installed ?? drive?.teeth?.count) % lobes) };
}

/** All answers about a design, and the problems of those that there are none of. */
export async function evaluate(design, signal) {
  // The picture joins copies of one tooth, whatever extent the document asks for.
  const drawn = { ...design, profile: { ...design.profile, extent: 'tooth' } };
  const { answer, problem, solveMs } = await ask('v1/design', drawn, { signal, kind: 'design' });
  const { geometry, coincidence_degree: coincidence, sweep, problems = {} } = answer ?? {};
  const listed = problem ? [problem] : Object.values(problems).map(problemInWords);
  return { design, answers: { design, zones: zonesOf(design), geometry, coincidence, sweep }, problems: listed, solveMs: solveMs ?? 0 };
}

/** Documents that came or are under way, and how long the others are waited for. */
const documents = new Map();
const patience = new Map();

async function fetchJson(path) {
  const timeoutMs = patience.get(path) ?? SUSPICIOUS_MS;
  patience.set(path, Math.min(2 * timeoutMs, MOST_PATIENCE_MS));
  const response = await request(path, { timeoutMs });
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response.json();
}

/** A document that stays as it is: what came is kept, and what did not gets twice the time when it is asked for again, so that a service
 *  which is only slow has told everything at last, however many documents there are. */
export function getJson(path) {
  if (!documents.has(path)) {
    const document = fetchJson(path);
    documents.set(path, document);
    document.catch(() => documents.delete(path));
  }
  return documents.get(path);
}

export class Service {
  #watch;
  #last;
  #lastMs = 0;
  #waiting;
  #running;
  #retryMs = FIRST_RETRY_MS;
  #isAway = false;
  #onResult;
  #onAway;
  #onBusy;
  #onSlow;

  /** `onResult(result)` for each evaluation that is finished; `onAway(isAway, detail)` and `onBusy(isBusy)` when that changes;
   *  `onSlow(seconds)` each second that an evaluation takes longer, undefined when it does no more. */
  constructor({ onResult, onAway, onBusy, onSlow }) {
    this.#onResult = onResult;
    this.#onAway = onAway;
    this.#onBusy = onBusy;
    this.#onSlow = onSlow;
    setInterval(() => this.#beat(), HEARTBEAT_MS);
  }

  /** Asks about a design; an earlier one that has no answer yet is given up. */
  request(design) {
    this.#last = design;
    this.#waiting = design;
    if (this.#running) {
      const age = performance.now() - this.#running.since;
      const grace = Math.min(MOST_GRACE_MS, Math.max(LEAST_GRACE_MS, GRACE * this.#lastMs));
      clearTimeout(this.#running.abortTimer);
      this.#running.abortTimer = setTimeout(() => this.#running?.controller.abort(), Math.max(0, grace - age));
    } else {
      this.#run();
    }
  }

  async #run() {
    const design = this.#waiting;
    this.#waiting = undefined;
    const controller = new AbortController();
    const running = { controller, since: performance.now() };
    this.#running = running;
    this.#onBusy(true);
    this.#watchOver(running);
    try {
      const result = await evaluate(design, controller.signal);
      this.#lastMs = performance.now() - running.since;
      this.#retryMs = FIRST_RETRY_MS;
      this.#setAway(false);
      this.#onResult(result);
    } catch (error) {
      if (error instanceof Unavailable) {
        this.#setAway(true, error.message);
        this.#waiting ??= design;
        await new Promise((resolve) => setTimeout(resolve, error.retryMs ?? this.#retryMs));
        this.#retryMs = Math.min(2 * this.#retryMs, LONGEST_RETRY_MS);
      } else if (!controller.signal.aborted) {
        throw error;
      }
    } finally {
      clearTimeout(running.abortTimer);
      this.#running = undefined;
      clearInterval(this.#watch);
      if (this.#waiting) this.#run();
      else {
        this.#onSlow(undefined);
        this.#onBusy(false);
      }
    }
  }

  /** Tells of an evaluation that takes long, and of a service that is silent. */
  #watchOver(running) {
    clearInterval(this.#watch);
    let isProbed = false;
    this.#watch = setInterval(async () => {
      if (isAsking()) return;
      const age = performance.now() - running.since;
      this.#onSlow(age / 1000);
      if (age < SUSPICIOUS_MS || isProbed) return;
      isProbed = true;
      if (!(await isAlive()) && this.#running === running) this.#setAway(true, t('service.silent'));
      isProbed = false;
    }, SLOW_MS);
  }

  /** An idle page notices too that the service went away. */
  async #beat() {
    if (document.hidden || this.#running) return;
    if (await isAlive()) return;
    this.#setAway(true, t('service.silent'));
    if (this.#last && !this.#running) this.request(this.#last);
  }

  #setAway(away, detail) {
    if (away === this.#isAway) return;
    this.#isAway = away;
    this.#onAway(away, detail);
  }
}
