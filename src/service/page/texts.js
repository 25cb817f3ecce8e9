// The page's texts by key, in the language that `language.js` chose before the first paint.

import { SERVICE as serviceEn, TEXTS as en } from './texts.en.js';
import { SERVICE as serviceZh, TEXTS as zh } from './texts.zh-cn.js';

const LANGUAGES = { en: { texts: en, service: serviceEn }, 'zh-CN': { texts: zh, service: serviceZh } };

/** A worker has no document, and shows no text. */
const { texts, service } = LANGUAGES[globalThis.document?.documentElement.lang ?? 'en'];

/** What the service says in English, in the page's language by its codes; nothing where that is English. */
export const SERVICE = service;

/** The text of a key such as `menu.help`, undefined where there is none. */
export const textOf = (key) => key.split('.').reduce((group, name) => group?.[name], texts);

/** A text in parts: its words, and in the place of each `{name}` that value, which may be an element. */
export const filled = (text, values) => text.split(/\{(\w+)\}/).map((part, index) => (index % 2 === 0 ? part : (values[part] ?? ''))).filter((part) => part !== '');

/** The parts of a key's text. */
export const parts = (key, values = {}) => filled(textOf(key) ?? key, values);

/** The text of a key, with values in the places of their names. */
export const t = (key, values) => parts(key, values).join('');

/** The text of a key for a count, that of `one` or of `many`. */
export const counted = (key, count, values) => t(`${key}.${count === 1 ? 'one' : 'many'}`, { count, ...values });

/** Texts in a row, with the comma of the language. */
export const listed = (items) => items.join(t('list.comma'));

/** A name and what is said of it. */
export const labelled = (label, text) => t('list.labelled', { label, text });

/** A text as it stands within a sentence, and at the beginning of one. */
export const small = (text) => text[0].toLowerCase() + text.slice(1);
export const capital = (text) => text[0].toUpperCase() + text.slice(1);

/** Writes the texts of the document: those of `data-text`, where an element with `data-slot` takes the place of that name, and of attributes. */
export function writeTexts(root = document) {
  for (const element of root.querySelectorAll('[data-text]')) {
    const slots = Object.fromEntries([...element.querySelectorAll('[data-slot]')].map((slot) => [slot.dataset.slot, slot]));
    element.replaceChildren(...parts(element.dataset.text, slots));
  }
  for (const element of root.querySelectorAll('[data-label]')) element.setAttribute('aria-label', t(element.dataset.label));
  for (const element of root.querySelectorAll('[data-title]')) element.setAttribute('title', t(element.dataset.title));
}
