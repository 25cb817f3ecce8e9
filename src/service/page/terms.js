// What the words mean, where they stand: a mark beside a word opens its definition, and the help lists all of them.

import { html, placeBeside } from './dom.js';
import { listed, t, textOf } from './texts.js';

export const TERMS = textOf('term');

const definition = html('div', { id: 'definition', class: 'definition', popover: 'auto', role: 'note' });

/** A mark that opens definitions beside it. */
export const term = (...keys) => explained(...keys.map((key) => TERMS[key]));

/** The same of `{ title, text }`. */
export function explained(...entries) {
  const names = listed(entries.map(({ title }) => title));
  const button = html('button', { type: 'button', class: 'term', 'aria-label': t('definition.label', { names }) }, '?');
  // A press outside closes it before the click is heard, which would then open it anew.
  let wasOpen = false;
  const isOpen = () => definition.matches(':popover-open') && definition.previousSibling === button;
  button.addEventListener('pointerdown', () => {
    wasOpen = isOpen();
  });
  button.addEventListener('click', (event) => {
    // A mark may stand inside what has a click of its own.
    event.preventDefault();
    const closes = wasOpen || isOpen();
    wasOpen = false;
    if (definition.matches(':popover-open')) definition.hidePopover();
    if (closes) return;
    definition.replaceChildren(html('dl', {}, entries.map(({ title, text }) => [html('dt', {}, title), html('dd', {}, text)]).flat()));
    // Beside its mark in the document too, so that the next press of Tab and a screen reader find it there; in a dialog nothing else
    // can be reached.
    button.after(definition);
    definition.showPopover();
    placeBeside(definition, button);
  });
  return button;
}

export const glossary = () => html('dl', { class: 'glossary' }, Object.values(TERMS).map(({ title, text }) => [html('dt', {}, title), html('dd', {}, text)]).flat());
