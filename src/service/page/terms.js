// What the words mean, where they stand: a mark beside a word opens its definition, and the help lists all of them.

import { html, placeBeside } from './dom.js';

const PAPER =
  'Wang Su, Bai Xin, Chen Shixian, Wang Chunyan: Research on analysis of force and contacting stress for the discrete teeth harmonic drives. ' +
  'Journal of Chongqing University 36(1), 2013, 35–42 (in Chinese).';

export const TERMS = {
  coincidence: {
    title: 'Contact ratio ε',
    text: 'The paper’s coincidence degree: how many teeth touch the ring’s flanks at once, on average over a turn and in all meshing zones together. More teeth share the load.',
  },
  position: {
    title: 'Position ψ',
    text: 'Where a tooth stands, as the angle from the middle of a lobe of the wave generator, of an ellipse its major axis. At ψ = 0° it is pushed out farthest, into the root of the ring; it enters the ring’s flank at ψ_e, at most in the valley between two lobes, which an ellipse has at 90°.',
  },
  lobes: {
    title: 'Lobes U',
    text: 'How many times the wave generator pushes a tooth outward in one turn: an ellipse twice, an eccentric circle once. As many teeth the carrier has more or fewer than the ring; the page sets the ring’s teeth when the lobes change.',
  },
  slots: {
    title: 'Slots in theory Z_G',
    text: 'How many slots the carrier has room for: the count that sets the ratio, as many more or fewer than the ring’s teeth as the wave generator has lobes. Of these slots all, or every second, third and so on, are made and hold a tooth.',
  },
  projection: {
    title: 'Projection',
    text: 'How the paper adds up what the contacts of a tooth yield: each approach is projected on the direction of the wave generator’s force. It makes the answers those of the paper.',
  },
  virtual_work: {
    title: 'Virtual work',
    text: 'The frictionless solution for a tooth that is free to find its place: each contact’s approach counts with the force that it takes. It is the one that follows from mechanics alone.',
  },
  race: {
    title: 'Race',
    text: 'A ring around the cam, free to turn: that of a thin bearing which the cam bends, or of the bearing that is itself the eccentric. Teeth on a plain cam slide with nearly the cam’s own speed; a race nearly stands still with them, and the bearing’s small friction takes the place of theirs.',
  },
  wear: {
    title: 'Wear rate',
    text: 'The volume that a surface loses, over the force and the way that it is rubbed with (Archard): it has to be measured for the pair of materials and its lubrication. From it follows how deep each part wears in an hour, where it wears most.',
  },
  pressure_velocity: {
    title: 'Pressure times velocity p·v',
    text: 'The largest contact pressure of a tooth times the speed at which it slips there. Limits in handbooks are for the load over the projected area, which is far less: they must not be compared with it.',
  },
  paper: { title: 'The paper', text: PAPER },
};

const definition = html('div', { id: 'definition', class: 'definition', popover: 'auto', role: 'note' });

/** A mark that opens definitions beside it. */
export const term = (...keys) => explained(...keys.map((key) => TERMS[key]));

/** The same of `{ title, text }`. */
export function explained(...entries) {
  const names = entries.map(({ title }) => title).join(', ');
  const button = html('button', { type: 'button', class: 'term', 'aria-label': `What is meant: ${names}` }, '?');
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
