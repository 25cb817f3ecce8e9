// The client of the calculation service: the newest design wins, stale requests are aborted, and a service that went away is
// asked again until it answers.

/** A running evaluation is left to finish although a newer design waits, unless it takes much longer than the last one took:
 *  a dragged slider then shows every answer that it can get, instead of aborting each one just before it arrives. */
const GRACE = 2;
const LEAST_GRACE_MS = 80;
const MOST_GRACE_MS = 1000;
const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 5000;
const HEARTBEAT_MS = 5000;

const ENDPOINTS = { geometry: 'v1/geometry', coincidence: 'v1/coincidence-degree', sweep: 'v1/sweep' };

/** The service cannot be reached, or is too busy to answer. */
class Unavailable extends Error {
  constructor(message, retryMs) {
    super(message);
    this.retryMs = retryMs;
  }
}

const JSON_TYPE = 'application/json';

/** One answer, or the problem in its place; anything but JSON is answered as a `Blob`. */
export async function ask(path, design, { signal, accept = JSON_TYPE } = {}) {
  let response;
  let body;
  try {
    response = await fetch(path, {
      method: 'POST',
      headers: { 'content-type': JSON_TYPE, accept },
      body: JSON.stringify(design),
      signal,
    });
    body = await (response.ok && accept !== JSON_TYPE ? response.blob() : response.json());
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Unavailable('The calculation service does not answer.');
  }
  if (response.status === 503) {
    throw new Unavailable(body.detail, 1000 * Number(response.headers.get('retry-after') ?? 1));
  }
  if (!response.ok) return { problem: body };
  const solve = /dur=([\d.]+)/.exec(response.headers.get('server-timing') ?? '');
  return { answer: body, solveMs: solve ? Number(solve[1]) : undefined };
}

/** All answers about a design, and the problems of those that there are none of. */
export async function evaluate(design, signal) {
  // The picture joins copies of one tooth, whatever extent the document asks for.
  const drawn = { ...design, profile: { ...design.profile, extent: 'tooth' } };
  const names = Object.keys(ENDPOINTS);
  const replies = await Promise.all(
    names.map((name) => ask(ENDPOINTS[name], name === 'geometry' ? drawn : design, { signal })),
  );
  const result = { design, answers: {}, problems: [], solveMs: 0 };
  names.forEach((name, index) => {
    const { answer, problem, solveMs } = replies[index];
    if (problem) result.problems.push(problem);
    else result.answers[name] = answer;
    result.solveMs += solveMs ?? 0;
  });
  return result;
}

export const getJson = async (path) => {
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response.json();
};

export class Service {
  #last;
  #lastMs = 0;
  #waiting;
  #running;
  #retryMs = FIRST_RETRY_MS;
  #isAway = false;
  #onResult;
  #onAway;
  #onBusy;

  /** `onResult(result)` for each evaluation that is finished; `onAway(isAway, detail)` and `onBusy(isBusy)` when that changes. */
  constructor({ onResult, onAway, onBusy }) {
    this.#onResult = onResult;
    this.#onAway = onAway;
    this.#onBusy = onBusy;
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
      if (this.#waiting) this.#run();
      else this.#onBusy(false);
    }
  }

  /** An idle page notices too that the service went away. */
  async #beat() {
    if (document.hidden || this.#running) return;
    try {
      await fetch('health/live', { cache: 'no-store' });
    } catch {
      this.#setAway(true, 'The calculation service does not answer.');
      if (this.#last && !this.#running) this.request(this.#last);
    }
  }

  #setAway(away, detail) {
    if (away === this.#isAway) return;
    this.#isAway = away;
    this.#onAway(away, detail);
  }
}
