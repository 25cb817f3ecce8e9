// Copying a text, told on the button that was pressed.

import { byId, html, setText } from './dom.js';
import { t } from './texts.js';

const TOLD_MS = 1500;

async function written(text, button) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    // Browsers give the clipboard only to secure origins; the old way works on the others.
    const area = html('textarea', { readonly: true, class: 'hidden', value: text });
    button.parentElement.append(area);
    area.select();
    const isDone = document.execCommand('copy');
    area.remove();
    button.focus();
    return isDone;
  }
}

export async function copy(text, button) {
  const label = button.textContent;
  const message = (await written(text, button)) ? t('menu.copied') : t('menu.copying_failed');
  setText(button, message);
  setText(byId('announcer'), message);
  setTimeout(() => setText(button, label), TOLD_MS);
}
