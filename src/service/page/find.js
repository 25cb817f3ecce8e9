// From requirements to a drive: searches for each kind of drive that may be, and what they come to, with reasons.

import { Progress, problemNote } from './ask.js';
import { changed, isSame } from './design.js';
import { html } from './dom.js';
import { readable, sentence } from './findings.js';
import { Form } from './form.js';
import { number } from './format.js';
import { Front } from './front.js';
import { counted, limitInWords, roomFor, small, together } from './reasons.js';
import { FIRST, GROUPS, ROOT, faultsOf, fieldOf, goalsOf, searchesOf } from './requirements.js';
import { Run } from './studies.js';

/** Narrower than this the results stand below the form. */
const NARROW = '(max-width: 900px)';

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
    const formElement = html('form', { class: 'form', 'aria-label': 'Requirements', autocomplete: 'off', novalidate: true }, html('h2', {}, 'What must it do?'));
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
      html('p', { class: 'none' }, 'From ratio, torque and space to drives that can be built: many thousand variants are calculated, and those are kept that none beats in all that counts. The reasons why the others fell are told below.'),
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
    column.append(this.reasons);
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
    this.form.setResult({}, false, faults, []);
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
    for (const [index, { label, question, fault }] of searches.entries()) {
      if (this.#isCancelled) break;
      if (fault) {
        notes.push(html('p', {}, `${capital(label)}: ${fault}.`));
        continue;
      }
      const share = (part) => (index + part) / searches.length;
      this.progress.show(`${capital(label)}…`, share(0));
      this.#run = new Run();
      try {
        const { answer, problem } = await this.#run.follow(question, ({ variants, lookedAt, full }) => {
          this.progress.show(full ?? `${capital(label)}: ${number(lookedAt, 9)} of ${number(variants, 9)} variants`, full ? undefined : share(lookedAt / variants));
        });
        if (problem) notes.push(problemNote({ ...problem, title: `${capital(label)}: ${problem.title}` }));
        if (answer) answers.push({ label, answer });
      } catch (error) {
        if (attempt !== this.#attempt || this.#isCancelled) break;
        throw error;
      }
      if (attempt !== this.#attempt) return;
      this.#show(together(answers, goals), goals, notes, index + 1 < searches.length);
    }
    if (attempt !== this.#attempt) return;
    this.progress.hide();
    this.#show(together(answers, goals), goals, notes, false);
  }

  #show(found, goals, notes, isUnderWay) {
    const { front, scan, without } = found;
    const headline =
      front.length > 0
        ? `${front.length === 1 ? 'One drive keeps' : `${front.length} drives keep`} every limit, and ${front.length === 1 ? 'it beats all others' : 'none is beaten by another in everything that counts'}.`
        : isUnderWay || scan.variants === 0
          ? ''
          : 'No drive keeps every limit.';
    const [first] = without.filter(() => front.length === 0 && !isUnderWay);
    this.state.replaceChildren(
      html('p', { class: 'headline' }, this.#isCancelled ? 'Cancelled. ' : '', headline),
      ...(first ? without.map((miss) => this.#missNote(miss, without.length > 1)) : []),
      ...notes,
    );
    this.front.show(front, goals);
    this.#showReasons(found);
  }

  /** What would have to give for a kind of drive to be possible. */
  #missNote({ label, miss, relaxations }, isNamed) {
    const name = isNamed ? [html('h3', {}, capital(label))] : [];
    if (!miss) return html('div', {}, name, html('p', {}, 'Nothing that was looked at is a drive at all: the reasons below say why.'));
    // What makes a drive buildable is not to be had for less.
    const items = relaxations.filter(({ quantity }) => fieldOf(quantity)).map((relaxation) => {
      const { quantity, limit, needed } = relaxation;
      const { label: what, is_flag: isFlag } = this.quantities.get(quantity);
      const words = isFlag ? `${what} allowed` : `${what} ${this.quantities.shown(quantity, needed)} instead of ${this.quantities.shown(quantity, limit)}`;
      const room = isFlag ? true : roomFor(relaxation);
      const allow = html('button', { type: 'button', class: 'link', onclick: () => this.#relax(fieldOf(quantity), room) }, isFlag ? 'Allow it' : `Set ${this.quantities.shown(quantity, room)}`);
      return html('li', {}, `${words}. `, allow);
    });
    const missed = miss.missed.map((limit) => `${small(this.quantities.get(limit.quantity).label)} ${this.quantities.shown(limit.quantity, miss.quantities[limit.quantity])} (${limitInWords(limit, this.quantities, { isWithin: true })})`);
    return html(
      'div',
      { class: 'miss' },
      name,
      items.length > 0 && [html('p', {}, 'One of these would do, all other limits kept:'), html('ul', {}, items)],
      html('p', {}, `The nearest miss: ${missed.join('; ')}. `, html('button', { type: 'button', class: 'link', onclick: () => this.front.onOpen({ ...miss, name: 'Nearest miss', label }) }, 'Open it as design')),
    );
  }

  /** Gives a limit room and looks again. */
  #relax(pointer, value) {
    this.#edit(changed(this.#requirements, pointer, value));
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
    const closest = limits.filter(({ binds }) => binds > 0).sort((one, other) => other.binds - one.binds);
    const binding = closest.length > 0 ? `The drives found are held back by: ${closest.map((limit) => limitInWords(limit, this.quantities, { isWithin: true })).join('; ')}. ` : '';
    this.reasons.replaceChildren(
      html('header', {}, html('h2', { id: 'reasons-title' }, 'Why no others')),
      html('p', {}, `${binding}Of ${number(scan.variants, 9)} variants spread evenly, ${counted(scan.good, scan.variants)} kept every limit and ${counted(scan.impossible, scan.variants)} were no drive at all.`),
      html(
        'div',
        { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Limits and what fell to them' },
        html('table', { class: 'drives reasons-table' }, html('thead', {}, html('tr', {}, ['Limit', 'Fell to it', 'To it alone', 'Found drives close to it'].map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text)))), html('tbody', {}, rows)),
      ),
      ...(scan.reasons.length === 0 ? [] : [html('details', {}, html('summary', {}, 'Why variants were no drive at all'), html('ul', { class: 'plain' }, scan.reasons.map(({ variants, detail }) => html('li', {}, `${number(variants, 9)}, such as: ${sentence(readable(detail))}`))))]),
      ...(front.length > 0 ? without.map((miss) => html('details', {}, html('summary', {}, `Nothing found: ${miss.label}`), this.#missNote(miss, false))) : []),
    );
  }
}

const capital = (text) => text[0].toUpperCase() + text.slice(1);
