// What is told of the design at the top: why it cannot exist, its findings, a service that is slow or away. Screen readers are told too.

import { byId, html, setProperties, setText } from './dom.js';
import { titleOf } from './findings.js';
import { fixed } from './format.js';
import { counted, labelled, listed, t } from './texts.js';
import { sentence } from './words.js';

const ANNOUNCE_DELAY_MS = 700;
/** Only a calculation longer than this is worth a sign. */
const BUSY_DELAY_MS = 400;

export class Status {
  #announceTimer;
  #busyTimer;

  /** `labelOf(pointer)` and `goTo(pointer)` as of the form. */
  constructor({ labelOf, goTo }) {
    Object.assign(this, { labelOf, goTo });
  }

  #worded({ pointer, detail }) {
    return pointer ? labelled(this.labelOf(pointer), detail) : detail;
  }

  /** `kept` says what stands in place of the answers that there are none of. */
  show({ reasons, findings, assumptions }, kept) {
    this.#showReasons(reasons, kept);
    this.#showFindings(findings, reasons.length > 0, assumptions);
    this.#announceLater(reasons, findings);
  }

  /** In the line under the key figures, which is always there: what takes room of its own would push the page about. */
  #showReasons(reasons, kept) {
    const banner = byId('impossible');
    setProperties(banner, { hidden: reasons.length === 0 });
    if (banner.hidden) return;
    const items = reasons.map((reason) => ({ pointer: reason.pointer, text: this.#worded(reason) }));
    setText(byId('impossible-title'), sentence(reasons[0].title));
    setText(byId('impossible-first'), items.length > 1 ? t('status.and_more', { reason: items[0].text, count: items.length - 1 }) : items[0].text);
    const item = ({ pointer, text }) => html('li', {}, pointer ? html('button', { type: 'button', class: 'link', onclick: () => this.goTo(pointer) }, text) : text);
    byId('impossible-all').replaceChildren(html('p', {}, kept), html('ul', {}, items.map(item)));
  }

  /** What is told where there is nothing wrong. */
  #showFindings(findings, hasReasons, assumptions) {
    const line = byId('status-findings');
    setProperties(line, { hidden: hasReasons });
    setText(line, findings.length === 0 ? assumptions.join(' ') || t('status.no_findings') : labelled(counted('status.findings', findings.length), listed(findings.map(titleOf))));
    setProperties(line, { className: ['problem', 'warning'].find((wanted) => findings.some(({ severity }) => severity === wanted)) ?? '' });
  }

  #announceLater(reasons, findings) {
    clearTimeout(this.#announceTimer);
    this.#announceTimer = setTimeout(() => {
      if (reasons.length > 0) this.say(`${sentence(reasons[0].title)} ${reasons.map((reason) => sentence(this.#worded(reason))).join(' ')}`);
      else this.say(findings.length > 0 ? t('announce.findings', { list: listed(findings.map(titleOf)) }) : t('announce.no_findings'));
    }, ANNOUNCE_DELAY_MS);
  }

  /** To screen readers alone. */
  say(text) {
    setText(byId('announcer'), text);
  }

  /** In a banner that stays until it is closed. */
  notify(text) {
    byId('notice').hidden = false;
    setText(byId('notice-text'), text);
  }

  busy(isBusy) {
    const figures = byId('key-figures');
    figures.setAttribute('aria-busy', String(isBusy));
    clearTimeout(this.#busyTimer);
    if (isBusy) this.#busyTimer = setTimeout(() => figures.classList.add('busy'), BUSY_DELAY_MS);
    else figures.classList.remove('busy');
  }

  slow(seconds) {
    const line = byId('slow');
    setProperties(line, { hidden: seconds === undefined });
    if (seconds !== undefined) setText(line, t('status.slow', { seconds: fixed(seconds, 0) }));
  }

  away(isAway, detail) {
    const banner = byId('away');
    banner.hidden = !isAway;
    if (isAway) banner.replaceChildren(html('strong', {}, detail), ` ${t('service.asks_again')}`);
    else this.say(t('service.answers_again'));
  }
}
