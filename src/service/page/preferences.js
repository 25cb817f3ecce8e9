// What a reader sets for this browser: theme, language, and whether the introduction is shown.

import { byId, setText } from './dom.js';
import { t } from './texts.js';

const root = document.documentElement;
const THEMES = ['auto', 'light', 'dark'];

/** Storage may be forbidden: what is set then lasts as long as the page. */
function keep(name, value) {
  try {
    localStorage.setItem(name, value);
  } catch {
    return false;
  }
  return true;
}

const currentTheme = () => root.dataset.theme ?? 'auto';
const showTheme = () => setText(byId('theme'), t(`menu.theme.${currentTheme()}`));

function nextTheme() {
  const theme = THEMES[(THEMES.indexOf(currentTheme()) + 1) % THEMES.length];
  if (theme === 'auto') delete root.dataset.theme;
  else root.dataset.theme = theme;
  keep('theme', theme);
  showTheme();
}

/** Loads the page anew in the other language; `beforeReload()` keeps what it shows. */
function otherLanguage(beforeReload) {
  if (!keep('language', root.lang === 'en' ? 'zh-CN' : 'en')) return;
  beforeReload();
  location.reload();
}

function showIntro(isShown) {
  byId('intro').hidden = !isShown;
  keep('intro', isShown ? 'shown' : 'hidden');
}

function isIntroHidden() {
  try {
    return localStorage.getItem('intro') === 'hidden';
  } catch {
    return false;
  }
}

export function listenToPreferences(beforeReload) {
  showTheme();
  byId('intro').hidden = isIntroHidden();
  byId('theme').addEventListener('click', nextTheme);
  byId('language').addEventListener('click', () => otherLanguage(beforeReload));
  byId('intro-hide').addEventListener('click', () => showIntro(false));
  byId('help-intro').addEventListener('click', () => {
    byId('help-dialog').close();
    showIntro(true);
    byId('intro').scrollIntoView({ block: 'start' });
  });
}
