// Requests with the key that a service may want. The key is kept here, in memory, and nowhere else: a page that is loaded anew asks
// for it again.

let key;
let asking;
let wanted = () => {};

/** `onWanted(detail)` when the service answers that it wants a key, or another one than was given. */
export const listen = (onWanted) => {
  wanted = onWanted;
};

/** The key that all requests from now on carry, those that wait for one among them. */
export function open(given) {
  key = given;
  asking?.resolve();
  asking = undefined;
}

export const isAsking = () => asking !== undefined;

function aborted(signal) {
  return new Promise((_, reject) => signal?.addEventListener('abort', () => reject(signal.reason), { once: true }));
}

/** As `fetch`, each attempt within `timeoutMs` where that is given; what is refused for want of a key is asked anew as soon as there is
 *  one. */
export async function request(path, { timeoutMs, ...options } = {}) {
  for (;;) {
    const carried = key;
    const headers = carried === undefined ? options.headers : { ...options.headers, authorization: `Bearer ${carried}` };
    const signal = timeoutMs === undefined ? options.signal : AbortSignal.timeout(timeoutMs);
    const response = await fetch(path, { ...options, headers, signal });
    if (response.status !== 401) return response;
    // Another request may have brought a key while this one was under way.
    if (carried !== key) continue;
    if (!asking) {
      asking = Promise.withResolvers();
      const { detail } = await response.json().catch(() => ({}));
      if (asking) wanted(detail, carried !== undefined);
    }
    await Promise.race([asking?.promise, aborted(options.signal)]);
  }
}
