// The address and the file: both hold the design document as it goes over the wire.

function encode(design) {
  const bytes = new TextEncoder().encode(JSON.stringify(design));
  const binary = Array.from(bytes, (byte) => String.fromCharCode(byte)).join('');
  return btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

function decode(text) {
  const binary = atob(text.replaceAll('-', '+').replaceAll('_', '/'));
  return JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(Uint8Array.from(binary, (c) => c.charCodeAt(0))));
}

const isObject = (value) => typeof value === 'object' && value !== null && !Array.isArray(value);

/** What the address holds: `{ design, reference }`, each undefined where there is none. Throws where it cannot be read. */
export function fromAddress(hash) {
  const parameters = new URLSearchParams(hash.replace(/^#/, ''));
  const read = (name) => {
    const text = parameters.get(name);
    if (!text) return undefined;
    const design = decode(text);
    if (!isObject(design)) throw new Error('no design document');
    return design;
  };
  return { design: read('design'), reference: read('reference') };
}

export function toAddress(design, reference) {
  return `#design=${encode(design)}` + (reference ? `&reference=${encode(reference)}` : '');
}

export const toText = (design) => `${JSON.stringify(design, null, 2)}\n`;

/** The document in a text; throws a message for the user where there is none. */
export function fromText(text) {
  let design;
  try {
    design = JSON.parse(text);
  } catch (error) {
    throw new Error(`This is no JSON: ${error.message}`);
  }
  if (!isObject(design)) throw new Error('A design document is a JSON object; this is another value.');
  return design;
}

export const toFile = (design) => new Blob([toText(design)], { type: 'application/json' });

/** Hands a blob to the browser as a file to keep. */
export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
  // The click only starts the download; the blob has to outlive this turn.
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
