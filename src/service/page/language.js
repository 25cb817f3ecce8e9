// Loaded before the first paint. The language is the one chosen by hand, or else the first of the browser's that the page has.
{
  const LANGUAGES = { en: 'en', zh: 'zh-CN' };
  let chosen;
  try {
    chosen = localStorage.getItem('language');
  } catch {
    // Storage may be forbidden; then the browser's languages count.
  }
  const wanted = [chosen, ...navigator.languages].map((tag) => LANGUAGES[tag?.split('-')[0].toLowerCase()]);
  document.documentElement.lang = wanted.find((language) => language !== undefined) ?? 'en';
}
