// From requirements to a drive: searches for each kind of drive that may be, and what they come to, with reasons.

import { Progress } from './ask.js';
import { axes } from './chart.js';
import { at, changed, isSame } from './design.js';
import { html, svg } from './dom.js';
import { Form } from './form.js';
import { number } from './format.js';
import { Front } from './front.js';
import { apart, bestOf, held, limitInWords, roomFor, shareOf, together } from './reasons.js';
import { FIRST, GROUPS, ROOT, faultsOf, fieldOf, goalsOf, searchesOf, withAllowables } from './requirements.js';
import { bestRounded, roundingOf } from './rounding.js';
import { Run } from './studies.js';
import { capital, counted, labelled, small, t } from './texts.js';
import { detailOf, sentence } from './words.js';

/** Narrower than this the results stand below the form. */
const NARROW = '(max-width: 900px)';
/** Where a browser keeps the last search of this tab. */
const KEPT = 'found';

export class Find {
  #requirements = FIRST;
  #run;
  /** Counts presses: whoever is not the last has nothing more to say. */
  #attempt = 0;
  #isCancelled = false;
  #asked;
  /** The requirements that the shown drives keep. */
  #kept;

  /** `onOpen(design, title)` when a drive is taken as design, `onOpenBoth` with another one as reference. */
  constructor(section, { quantities, onOpen, onOpenBoth }) {
    this.quantities = quantities;
    this.button = html('button', { type: 'submit', class: 'primary' }, t('find.find'));
    const formElement = html('form', { class: 'form', 'aria-label': t('find.requirements'), autocomplete: 'off', novalidate: true }, html('h2', {}, t('find.requirements')));
    this.form = new Form(formElement, { onEdit: (requirements) => this.#edit(requirements), onEnd: () => this.#check() }, GROUPS, ROOT);
    formElement.append(html('div', { class: 'form-end' }, this.button));
    formElement.addEventListener('submit', (event) => {
      event.preventDefault();
      this.#find();
    });
    this.progress = new Progress(() => {
      this.#isCancelled = true;
      this.#run?.cancel();
    });
    this.state = html('div', { role: 'status', class: 'study-state' });
    this.results = html(
      'section',
      { class: 'panel', 'aria-labelledby': 'find-title' },
      html('header', {}, html('h2', { id: 'find-title', tabindex: '-1' }, t('view.find'))),
      html('p', { class: 'none' }, t('find.intro')),
      this.state,
    );
    this.earlier = html('p', { class: 'note warning', hidden: true }, t('find.earlier'));
    this.reasons = html('section', { class: 'panel', 'aria-labelledby': 'reasons-title', hidden: true });
    const column = html('div', { role: 'main', class: 'find-results' }, this.progress.element, this.results, this.earlier);
    this.front = new Front(column, {
      quantities,
      onOpen: ({ design, name, label }) => onOpen(withAllowables(design, this.#kept), t('find.drive_title', { name, label })),
      onOpenBoth: (...both) => onOpenBoth(...both.map(({ design, name }) => ({ design: withAllowables(design, this.#kept), title: name }))),
    });
    this.preview = previewOf();
    column.append(this.reasons, this.preview);
    section.append(html('div', { class: 'find-form' }, formElement), column);
    this.form.setDesign(this.#requirements, { respan: true });
  }

  #edit(requirements) {
    this.#requirements = requirements;
    this.form.setDesign(requirements);
    this.#check();
  }

  /** Says at the fields what is missing or cannot be; whether there is nothing of that. */
  #check() {
    const { faults, isEmpty } = faultsOf(this.#requirements);
    this.form.setResult({}, faults, []);
    const isOutdated = this.#kept !== undefined && !isSame(this.#kept, this.#requirements);
    this.earlier.hidden = !isOutdated || this.front.panel.hidden;
    this.reasons.classList.toggle('outdated', isOutdated);
    this.front.panel.classList.toggle('outdated', isOutdated);
    return faults.length === 0 && !isEmpty;
  }

  async #find() {
    const attempt = ++this.#attempt;
    this.#run?.giveUp();
    this.#isCancelled = false;
    if (!this.#check()) {
      this.state.replaceChildren(t('find.incomplete'));
      return;
    }
    this.#asked = this.#requirements;
    this.preview.hidden = true;
    const goals = goalsOf(this.#requirements);
    const searches = searchesOf(this.#requirements);
    const [answers, notes] = [[], []];
    this.state.replaceChildren();
    if (matchMedia(NARROW).matches) this.results.scrollIntoView({ block: 'start' });
    try {
      for (const [index, { label, question, fault }] of searches.entries()) {
        if (this.#isCancelled) break;
        if (fault) {
          notes.push(labelled(capital(label), sentence(fault)));
          continue;
        }
        const share = (part) => (index + part) / searches.length;
        this.progress.show(`${capital(label)}…`, share(0));
        const { answer, problem } = await this.#follow(question, ({ variants, lookedAt, full }) => {
          this.progress.show(full ?? labelled(capital(label), t('study.looked_at', { count: number(lookedAt, 9), all: number(variants, 9) })), full ? undefined : share(lookedAt / variants));
        });
        if (attempt !== this.#attempt) return;
        if (problem) notes.push(labelled(capital(label), `${sentence(problem.title)} ${sentence(problem.detail)}`));
        if (answer) answers.push({ label, question, answer });
      }
      const found = together(answers);
      const best = bestOf(found.drives, goals);
      const shown = at(this.#asked, `${ROOT}/rounded`) ? await this.#rounded(best, goals) : best;
      if (attempt !== this.#attempt) return;
      if (best.length > 0 && shown.length === 0) notes.push(t('find.none_rounded'));
      this.#finish({ ...found, ...held(shown, found.limits), goals, notes, isCancelled: this.#isCancelled });
    } catch (error) {
      if (attempt === this.#attempt && !this.#isCancelled) throw error;
    } finally {
      if (attempt === this.#attempt) this.progress.hide();
    }
  }

  #follow(question, onProgress) {
    this.#run = new Run();
    return this.#run.follow(question, onProgress);
  }

  /** The drives with rounded lengths, each calculated anew; those that then break a limit are left out. */
  async #rounded(drives, goals) {
    const rounded = [];
    for (const [index, found] of drives.entries()) {
      if (this.#isCancelled) break;
      this.progress.show(t('find.rounding', { index: index + 1, count: drives.length }), index / drives.length);
      const question = roundingOf(found);
      const { answer } = question ? await this.#follow(question) : {};
      const drive = question ? answer && bestRounded(found, answer, goals) : found;
      if (drive) rounded.push(drive);
    }
    return bestOf(rounded, goals);
  }

  /** Shows what was found, and keeps it for when the page is loaded anew. */
  #finish(found) {
    this.#kept = this.#asked;
    this.#show(found);
    this.#check();
    try {
      sessionStorage.setItem(KEPT, JSON.stringify({ requirements: this.#asked, found: { ...found, drives: undefined } }));
    } catch {
      // Storage may be forbidden or full; the drives then last as long as the page.
    }
  }

  /** Shows the last search of this tab. */
  restore() {
    try {
      const { requirements, found } = JSON.parse(sessionStorage.getItem(KEPT)) ?? {};
      if (!found) return;
      this.#kept = requirements;
      this.#edit(requirements);
      this.#show(found);
    } catch {
      // What cannot be read was kept by another build.
    }
  }

  /** Asks for drives with the ratio and the torque of a design. */
  askLike(design, { geometry, sweep } = {}) {
    const { count } = design.drive.teeth;
    const ratio = Math.abs(count / (count - design.drive.ring.teeth));
    const torque = sweep?.load?.output_torque_nm;
    const wanted = changed(changed(this.#requirements, `${ROOT}/ratio`, ratio), `${ROOT}/ratio_max`, undefined);
    this.#edit(geometry && torque > 0 ? changed(wanted, `${ROOT}/output_torque_nm`, Number(torque.toPrecision(4))) : wanted);
  }

  #show(found) {
    const { front, goals, notes, scan, without, isCancelled } = found;
    const headline = front.length > 0 ? counted('find.found', front.length) : scan.variants === 0 ? '' : t('find.none');
    const misses = front.length === 0 ? without : [];
    this.preview.hidden = true;
    this.state.replaceChildren(html('p', { class: 'headline' }, isCancelled ? `${t('find.cancelled')} ` : '', headline), ...misses.map((miss) => this.#missNote(miss, misses.length > 1)), ...notes.map((text) => html('p', {}, text)));
    this.front.show(front, goals);
    this.#showReasons(found);
  }

  /** What would have to give for a kind of drive to be possible. */
  #missNote({ label, miss, relaxations }, isNamed) {
    const name = isNamed ? [html('h3', {}, capital(label))] : [];
    if (!miss) return html('div', {}, name, html('p', {}, t('find.no_drive_at_all')));
    // What makes a drive buildable is not to be had for less.
    const items = relaxations.filter(({ quantity }) => fieldOf(quantity)).map((relaxation) => {
      const { quantity, limit, needed } = relaxation;
      const { label: what, is_flag: isFlag } = this.quantities.get(quantity);
      const words = isFlag ? t('find.allow', { what: small(what) }) : t('find.instead', { what, value: apart(this.quantities, quantity, needed, limit), limit: this.quantities.shown(quantity, limit) });
      const room = isFlag ? true : roomFor(relaxation);
      const allow = html('button', { type: 'button', onclick: () => this.#relax([[fieldOf(quantity), room]]) }, isFlag ? t('find.allow_it') : t('find.set', { value: apart(this.quantities, quantity, room, limit) }));
      return html('li', {}, `${sentence(words)} `, allow);
    });
    const missed = miss.missed.map((limit) => t('find.missed', { what: small(this.quantities.get(limit.quantity).label), value: apart(this.quantities, limit.quantity, miss.quantities[limit.quantity], limit.limit), limit: limitInWords(limit, this.quantities, { isWithin: true }) }));
    // Where no limit can give alone, those that the nearest miss breaks give together.
    const isTogether = items.length === 0 && miss.missed.every(({ quantity, bound }) => fieldOf(quantity) && bound !== 'is');
    const all = miss.missed.map((limit) => [fieldOf(limit.quantity), roomFor({ ...limit, needed: miss.quantities[limit.quantity] })]);
    return html(
      'div',
      { class: 'miss' },
      name,
      items.length > 0 && [html('p', {}, t('find.relax')), html('ul', {}, items)],
      html(
        'p',
        {},
        `${t('find.nearest', { missed: missed.join(t('list.semicolon')) })} `,
        isTogether && [html('button', { type: 'button', onclick: () => this.#relax(all) }, counted('find.relax_together', all.length)), ' '],
        html('button', { type: 'button', class: 'link', onclick: () => this.front.onOpen({ ...miss, name: t('find.nearest_drive'), label }) }, t('find.open_it')),
      ),
    );
  }

  /** Gives limits room and looks again. */
  #relax(limits) {
    this.#edit(limits.reduce((requirements, [pointer, value]) => changed(requirements, pointer, value), this.#requirements));
    this.#find();
  }

  #showReasons({ front, limits, scan, without }) {
    this.reasons.hidden = scan.variants === 0;
    if (this.reasons.hidden) return;
    const rows = limits.map((limit) => {
      const bar = html('span', { class: 'bar', 'aria-hidden': 'true' });
      bar.style.setProperty('--share', limit.fell / scan.variants);
      return html(
        'tr',
        { class: limit.binds > 0 && 'binds' },
        html('th', { scope: 'row' }, limitInWords(limit, this.quantities)),
        html('td', { class: 'numeric number' }, shareOf(limit.fell, scan.variants), bar),
        html('td', { class: 'numeric number' }, number(limit.fell_alone, 9)),
        html('td', { class: 'numeric number' }, front.length > 0 && limit.bound !== 'is' ? t('find.close_to', { count: limit.binds, all: front.length }) : '–'),
      );
    });
    this.reasons.replaceChildren(
      html('header', {}, html('h2', { id: 'reasons-title' }, t('find.limits'))),
      html('p', {}, t('find.scan', { variants: number(scan.variants, 9), impossible: shareOf(scan.impossible, scan.variants) })),
      html(
        'div',
        { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': t('find.limits_table') },
        html('table', { class: 'drives reasons-table' }, html('thead', {}, html('tr', {}, [t('find.limit'), t('find.stopped'), t('find.alone'), t('find.close')].map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text)))), html('tbody', {}, rows)),
      ),
      ...(scan.reasons.length === 0 ? [] : [html('details', {}, html('summary', {}, t('find.why_none')), html('ul', { class: 'plain' }, scan.reasons.map(({ variants, ...reason }) => html('li', {}, t('study.such_as', { count: number(variants, 9), reason: sentence(detailOf(reason)) })))))]),
      ...(front.length > 0 ? without.map((miss) => html('details', {}, html('summary', {}, t('find.nothing_found', { label: miss.label })), this.#missNote(miss, false))) : []),
    );
  }
}

/** What will stand where nothing was looked for yet. */
function previewOf() {
  const { root, plot, x, y } = axes(420, 200, { label: t('find.preview.x'), min: 80, max: 120 }, { label: t('find.preview.y'), min: 150, max: 450 });
  for (let mm = 88; mm < 118; mm += 3) plot.append(svg('circle', { class: 'curve-dot', cx: x(mm), cy: y(200 + 6.2 * (mm - 88)), r: 4.5 }));
  const shown = [t('find.preview.chart'), t('find.preview.drive'), t('find.preview.table'), t('find.preview.limits')];
  return html('section', { class: 'panel preview', 'aria-label': t('find.preview.label') }, html('p', {}, t('find.preview.press')), html('ol', {}, shown.map((text) => html('li', {}, text))), html('div', { 'aria-hidden': 'true' }, html('p', { class: 'none' }, t('find.preview.example')), root));
}
