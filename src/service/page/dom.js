// Building elements without markup in strings: the page's policy allows no inline style or script, and nothing needs escaping.

const SVG = 'http://www.w3.org/2000/svg';

function build(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'value') element.value = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat().filter((child) => child !== undefined && child !== null && child !== false));
  return element;
}

export const byId = (id) => document.getElementById(id);

export const html = (tag, attributes, ...children) => build(document.createElement(tag), attributes, children);
export const svg = (tag, attributes, ...children) => build(document.createElementNS(SVG, tag), attributes, children);

/** Writes only what changed, so that nothing flickers and screen readers are not told the same thing twice. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets properties as `setText` does: a browser styles an element anew even where it is given the `hidden`, `value` or `placeholder` that it has. */
export function setProperties(element, properties) {
  for (const [name, value] of Object.entries(properties)) {
    if (element[name] !== value) element[name] = value;
  }
}

export function setAttributes(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

/** Replaces children only where they differ: taking a node out and in again would lose the focus inside it. */
export function setChildren(parent, nodes) {
  const isSame = nodes.length === parent.childNodes.length && nodes.every((node, index) => node === parent.childNodes[index]);
  if (!isSame) parent.replaceChildren(...nodes);
}

/** A symbol with its index set low: `F_H`, `i_HG`. */
export function symbol(text) {
  const [base, index] = text.split('_');
  return html('i', { class: 'symbol' }, base, index && html('sub', {}, index));
}

/** Calls `work` once in the next frame however often it is asked for. */
export function oncePerFrame(work) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      work();
    });
  };
}

/** Puts an open popover beside the form that its button is in, so that it covers no field; else below the button, or above it, where there is
 *  room. */
export function placeBeside(popover, button) {
  const { left, bottom, top } = button.getBoundingClientRect();
  const { offsetWidth: width, offsetHeight: height } = popover;
  const { clientWidth } = document.documentElement;
  const formEnd = (button.closest('form')?.getBoundingClientRect().right ?? clientWidth) + 8;
  const isBeside = formEnd + width + 8 <= clientWidth;
  const below = bottom + 6 + height <= innerHeight;
  popover.style.left = `${isBeside ? formEnd : Math.max(8, Math.min(left, clientWidth - width - 8))}px`;
  popover.style.top = `${isBeside ? Math.max(8, Math.min(top, innerHeight - height - 8)) : below ? bottom + 6 : Math.max(8, top - 6 - height)}px`;
}
