// The bar at the top: its menus, its row of buttons, and the links that skip to parts of the page.

import { byId } from './dom.js';
import { Toolbar } from './toolbar.js';

function placeMenu(menu) {
  const opener = document.querySelector(`[popovertarget="${menu.id}"]`);
  menu.addEventListener('beforetoggle', () => {
    const { left, bottom } = opener.getBoundingClientRect();
    menu.style.setProperty('--left', `${left}px`);
    menu.style.setProperty('--top', `${Math.max(8, bottom + 4)}px`);
  });
}

/** Their places are no part of the address, which is the design's. */
function skip(event) {
  event.preventDefault();
  const target = document.querySelector(event.currentTarget.hash);
  target.focus({ preventScroll: true });
  target.scrollIntoView({ block: 'start' });
}

export function listenToMenus() {
  document.querySelectorAll('.menu').forEach(placeMenu);
  // What only shows something new in its own place leaves the menu open. It closes first, so that the focus comes back to its button.
  byId('menu').addEventListener('click', ({ target }) => target.closest('#theme, #copy-link') ?? byId('menu').hidePopover(), true);
  byId('examples').addEventListener('click', () => byId('examples').hidePopover());
  for (const link of document.querySelectorAll('.skip')) link.addEventListener('click', skip);
  byId('help').addEventListener('click', () => byId('help-dialog').showModal());
  byId('help-close').addEventListener('click', () => byId('help-dialog').close());
  byId('effect-hide').addEventListener('click', () => {
    byId('effect').hidden = true;
  });
  byId('print-page').addEventListener('click', () => print());
  new Toolbar(byId('tools'));
}
