// From requirements to a drive: searches for each kind of drive that may be, and what they come to, with reasons.

import { Progress } from './ask.js';
import { axes } from './chart.js';
import { at, changed, isSame } from './design.js';
import { html, svg } from './dom.js';
import { readable, sentence } from './findings.js';
import { Form } from './form.js';
import { number } from './format.js';
import { Front } from './front.js';
import { apart, bestOf, counted, held, limitInWords, roomFor, small, together } from './reasons.js';
import { FIRST, GROUPS, ROOT, faultsOf, fieldOf, goalsOf, searchesOf } from './requirements.js';
import { bestRounded, roundingOf } from './rounding.js';
import { Run } from './studies.js';

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

  /** `onOpen(design, title)` when a drive is taken as design, `onOpenBoth` with another one as reference. */
  constructor(section, { quantities, onOpen, onOpenBoth }) {
    this.quantities = quantities;
    this.button = html('button', { type: 'submit', class: 'primary' }, 'Find drives');
    const formElement = html('form', { class: 'form', 'aria-label': 'Requirements', autocomplete: 'off', novalidate: true }, html('h2', {}, 'Requirements'));
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
      html('header', {}, html('h2', { id: 'find-title', tabindex: '-1' }, 'Find a drive')),
      html('p', { class: 'none' }, 'Enter ratio, torque and available space. The search evaluates thousands of drives and shows the best trade-offs.'),
      this.progress.element,
      this.state,
    );
    this.reasons = html('section', { class: 'panel', 'aria-labelledby': 'reasons-title', hidden: true });
    const column = html('div', { role: 'main', class: 'find-results' }, this.results);
    this.front = new Front(column, {
      quantities,
      onOpen: ({ design, name, label }) => onOpen(design, `${name}, ${label}`),
      onOpenBoth: (found, reference) => onOpenBoth({ design: found.design, title: found.name }, { design: reference.design, title: reference.name }),
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
    const isOutdated = this.#asked !== undefined && !isSame(this.#asked, this.#requirements);
    this.reasons.classList.toggle('outdated', isOutdated);
    this.front.panel.classList.toggle('outdated', isOutdated);
    return faults.length === 0 && !isEmpty;
  }

  async #find() {
    const attempt = ++this.#attempt;
    this.#run?.giveUp();
    this.#isCancelled = false;
    if (!this.#check()) {
      this.state.replaceChildren('Something is missing or cannot be: see the marked fields.');
      return;
    }
    this.#asked = this.#requirements;
    this.#check();
    const goals = goalsOf(this.#requirements);
    const searches = searchesOf(this.#requirements);
    const [answers, notes] = [[], []];
    this.state.replaceChildren();
    if (matchMedia(NARROW).matches) this.results.scrollIntoView({ block: 'start' });
    try {
      for (const [index, { label, question, fault }] of searches.entries()) {
        if (this.#isCancelled) break;
        if (fault) {
          notes.push(`${capital(label)}: ${fault}.`);
          continue;
        }
        const share = (part) => (index + part) / searches.length;
        this.progress.show(`${capital(label)}…`, share(0));
        const { answer, problem } = await this.#follow(question, ({ variants, lookedAt, full }) => {
          this.progress.show(full ?? `${capital(label)}: ${number(lookedAt, 9)} of ${number(variants, 9)} variants`, full ? undefined : share(lookedAt / variants));
        });
        if (attempt !== this.#attempt) return;
        if (problem) notes.push(`${capital(label)}: ${problem.title}. ${problem.detail}`);
        if (answer) answers.push({ label, question, answer });
      }
      const found = together(answers);
      const best = bestOf(found.drives, goals);
      const shown = at(this.#asked, `${ROOT}/rounded`) ? await this.#rounded(best, goals) : best;
      if (attempt !== this.#attempt) return;
      if (best.length > 0 && shown.length === 0) notes.push('No drive keeps every limit when its lengths are rounded to 0.01 mm. Relax a limit a little, or show exact lengths.');
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
      this.progress.show(`Rounding to 0.01 mm: drive ${index + 1} of ${drives.length}`, index / drives.length);
      const question = roundingOf(found);
      const { answer } = question ? await this.#follow(question) : {};
      const drive = question ? answer && bestRounded(found, answer, goals) : found;
      if (drive) rounded.push(drive);
    }
    return bestOf(rounded, goals);
  }

  /** Shows what was found, and keeps it for when the page is loaded anew. */
  #finish(found) {
    this.#show(found);
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
      this.#asked = requirements;
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
    const headline = front.length > 0 ? `${front.length === 1 ? 'One drive meets' : `${front.length} drives meet`} all limits${front.length > 1 ? ' (Pareto front): none is better than another in everything that counts' : ''}.` : scan.variants === 0 ? '' : 'No drive meets all limits.';
    const misses = front.length === 0 ? without : [];
    this.preview.hidden = true;
    this.state.replaceChildren(html('p', { class: 'headline' }, isCancelled ? 'Cancelled. ' : '', headline), ...misses.map((miss) => this.#missNote(miss, misses.length > 1)), ...notes.map((text) => html('p', {}, text)));
    this.front.show(front, goals);
    this.#showReasons(found);
  }

  /** What would have to give for a kind of drive to be possible. */
  #missNote({ label, miss, relaxations }, isNamed) {
    const name = isNamed ? [html('h3', {}, capital(label))] : [];
    if (!miss) return html('div', {}, name, html('p', {}, 'None of the variants is a drive at all: the reasons are below.'));
    // What makes a drive buildable is not to be had for less.
    const items = relaxations.filter(({ quantity }) => fieldOf(quantity)).map((relaxation) => {
      const { quantity, limit, needed } = relaxation;
      const { label: what, is_flag: isFlag } = this.quantities.get(quantity);
      const words = isFlag ? `Allow ${small(what)}` : `${what}: ${apart(this.quantities, quantity, needed, limit)} instead of ${this.quantities.shown(quantity, limit)}`;
      const room = isFlag ? true : roomFor(relaxation);
      const allow = html('button', { type: 'button', onclick: () => this.#relax([[fieldOf(quantity), room]]) }, isFlag ? 'Allow it' : `Set ${apart(this.quantities, quantity, room, limit)}`);
      return html('li', {}, `${words}. `, allow);
    });
    const missed = miss.missed.map((limit) => `${small(this.quantities.get(limit.quantity).label)} ${apart(this.quantities, limit.quantity, miss.quantities[limit.quantity], limit.limit)} (${limitInWords(limit, this.quantities, { isWithin: true })})`);
    // Where no limit can give alone, those that the nearest miss breaks give together.
    const isTogether = items.length === 0 && miss.missed.every(({ quantity, bound }) => fieldOf(quantity) && bound !== 'is');
    const all = miss.missed.map((limit) => [fieldOf(limit.quantity), roomFor({ ...limit, needed: miss.quantities[limit.quantity] })]);
    return html(
      'div',
      { class: 'miss' },
      name,
      items.length > 0 && [html('p', {}, 'Relax one of these limits, all others kept:'), html('ul', {}, items)],
      html(
        'p',
        {},
        `The nearest drive breaks: ${missed.join('; ')}. `,
        isTogether && [html('button', { type: 'button', onclick: () => this.#relax(all) }, all.length > 1 ? 'Relax these limits together' : 'Relax this limit'), ' '],
        html('button', { type: 'button', class: 'link', onclick: () => this.front.onOpen({ ...miss, name: 'Nearest drive', label }) }, 'Open it as design'),
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
        html('td', { class: 'numeric number' }, counted(limit.fell, scan.variants), bar),
        html('td', { class: 'numeric number' }, number(limit.fell_alone, 9)),
        html('td', { class: 'numeric number' }, front.length > 0 && limit.bound !== 'is' ? `${limit.binds} of ${front.length}` : '–'),
      );
    });
    this.reasons.replaceChildren(
      html('header', {}, html('h2', { id: 'reasons-title' }, 'What limits the drives')),
      html('p', {}, `Before the search ${number(scan.variants, 9)} variants were spread evenly over all that is free. The table counts those that each limit stopped; ${counted(scan.impossible, scan.variants)} were no drive at all.`),
      html(
        'div',
        { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Limits and what fell to them' },
        html('table', { class: 'drives reasons-table' }, html('thead', {}, html('tr', {}, ['Limit', 'Stopped by it', 'By it alone', 'Drives found close to it'].map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text)))), html('tbody', {}, rows)),
      ),
      ...(scan.reasons.length === 0 ? [] : [html('details', {}, html('summary', {}, 'Why variants were no drive at all'), html('ul', { class: 'plain' }, scan.reasons.map(({ variants, detail }) => html('li', {}, `${number(variants, 9)}, such as: ${sentence(readable(detail))}`))))]),
      ...(front.length > 0 ? without.map((miss) => html('details', {}, html('summary', {}, `Nothing found: ${miss.label}`), this.#missNote(miss, false))) : []),
    );
  }
}

const capital = (text) => text[0].toUpperCase() + text.slice(1);

/** What will stand where nothing was looked for yet. */
function previewOf() {
  const { root, plot, x, y } = axes(420, 200, { label: 'Outer diameter, mm', min: 80, max: 120 }, { label: 'Torque capacity, N·m', min: 150, max: 450 });
  for (let mm = 88; mm < 118; mm += 3) plot.append(svg('circle', { class: 'curve-dot', cx: x(mm), cy: y(200 + 6.2 * (mm - 88)), r: 4.5 }));
  const parts = ['A chart of the best trade-offs: each mark is a drive that meets all limits.', 'The chosen drive with its picture and figures. It opens as a design.', 'A table of the drives, to compare two of them.', 'The limits that stop better drives. If no drive is found: the limit to relax, and to what.'];
  return html('section', { class: 'panel preview', 'aria-label': 'What the search will show' }, html('p', {}, 'Press “Find drives”. You will see here:'), html('ol', {}, parts.map((text) => html('li', {}, text))), html('div', { 'aria-hidden': 'true' }, html('p', { class: 'none' }, 'Example'), root));
}
