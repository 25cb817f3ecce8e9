// The address and the file: both hold the design document as it goes over the wire.

import { t } from './texts.js';

function encode(design) {
  const bytes = new TextEncoder().encode(JSON.stringify(design));
  const binary = Array.from(bytes, (byte) => String.fromCharCode(byte)).join('');
  return btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

function decode(text) {
  const binary = atob(text.replaceAll('-', '+').replaceAll('_', '/'));
  return fromText(new TextDecoder('utf-8', { fatal: true }).decode(Uint8Array.from(binary, (c) => c.charCodeAt(0))));
}

const isObject = (value) => typeof value === 'object' && value !== null && !Array.isArray(value);

/** A field that an object of a JSON text has twice, if any: browsers read the last one alone. */
function fieldGivenTwice(text) {
  const objects = [];
  const tokens = text.match(/"(?:[^"\\]|\\.)*"|[{}:]/g) ?? [];
  for (const [index, token] of tokens.entries()) {
    if (token === '{') objects.push(new Set());
    else if (token === '}') objects.pop();
    else if (tokens[index + 1] === ':') {
      const field = JSON.parse(token);
      if (objects.at(-1).has(field)) return field;
      objects.at(-1).add(field);
    }
  }
  return undefined;
}

/** What the address holds: `{ design, reference, view, broken }`, each of the first two undefined where there is none or none that can be
 *  read; `broken` names those. An address that holds something else, as a link that was cut short, is a broken design. */
export function fromAddress(hash) {
  const text = hash.replace(/^#/, '');
  const parameters = new URLSearchParams(text);
  const found = { view: parameters.get('view') ?? 'design', broken: [] };
  for (const name of ['design', 'reference']) {
    if (!parameters.has(name)) continue;
    try {
      const [text, ...others] = parameters.getAll(name);
      if (others.length > 0) throw new Error('several documents');
      found[name] = decode(text);
    } catch {
      found.broken.push(name);
    }
  }
  if (text && !parameters.has('view') && !found.design && !found.broken.includes('design')) found.broken.push('design');
  return found;
}

export function toAddress(design, reference, view) {
  return `#${view === 'design' ? '' : `view=${view}&`}design=${encode(design)}${reference ? `&reference=${encode(reference)}` : ''}`;
}

export const toText = (design) => `${JSON.stringify(design, null, 2)}\n`;

/** The document in a text; throws a message for the user where there is none. */
export function fromText(text) {
  let design;
  try {
    design = JSON.parse(text);
  } catch (error) {
    throw new Error(t('document.no_json', { fault: error.message }));
  }
  if (!isObject(design)) throw new Error(t('document.no_object'));
  const field = fieldGivenTwice(text);
  if (field !== undefined) throw new Error(t('document.given_twice', { field }));
  return design;
}

export const toFile = (design) => new Blob([toText(design)], { type: 'application/json' });

const inOrder = (value) =>
  isObject(value) ? Object.fromEntries(Object.keys(value).sort().map((key) => [key, inOrder(value[key])])) : Array.isArray(value) ? value.map(inOrder) : value;

/** Six digits that tell designs apart by their names: 24 bits of FNV-1a over the document with its fields in order. */
export function fingerprint(design) {
  let hash = 0x811c9dc5;
  for (const byte of new TextEncoder().encode(JSON.stringify(inOrder(design)))) hash = Math.imul(hash ^ byte, 0x01000193) >>> 0;
  return ((hash >>> 24) ^ (hash & 0xffffff)).toString(16).padStart(6, '0');
}

/** A file is named after its design: without what a file cannot be called, and with its fingerprint where others have the same title. */
export function fileNameOf(title, ending, design) {
  const words = title.replace(/[’']/g, '').replace(/[^\p{L}\p{N}_.]+/gu, '-').replace(/^-|-$/g, '').toLowerCase();
  return `${words}${design ? `-${fingerprint(design)}` : ''}${ending}`;
}

/** What a design is called that comes from a file: its name without the endings that this page itself gave it. */
export const titleOfFile = (name) => name.replace(/\.json$/i, '').replace(/(-changed)*(-[0-9a-f]{6})?$/, '') || name;

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
