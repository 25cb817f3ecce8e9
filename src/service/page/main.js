// What the page shows: one design, its answers, an input angle, a selected tooth and perhaps a reference. Everything on the page
// follows from these; each part of it is asked to show them, none keeps a second copy.

import * as access from './access.js';
import { Accuracy } from './accuracy.js';
import { CONVERTED, converted } from './convert.js';
import { changed, isSame, withVirtualWork } from './design.js';
import { html, oncePerFrame, setAttributes, setChildren, setProperties, setText } from './dom.js';
import { Drawings } from './drawings.js';
import { Explore } from './explore.js';
import { Find } from './find.js';
import { explanation, findingsOf, reasonsOf, titleOf } from './findings.js';
import { Form } from './form.js';
import { fixed, number } from './format.js';
import { History } from './history.js';
import { Losses } from './losses.js';
import { Mechanism, stressColor } from './mechanism.js';
import { CONTACTS, Motion } from './motion.js';
import { passOf } from './pass.js';
import { Plots } from './plots.js';
import { Quantities } from './quantities.js';
import { findingsTable, inputDifferences, reportOf } from './report.js';
import { Results } from './results.js';
import { Sensitivity } from './sensitivity.js';
import { Service, evaluate, getJson } from './service.js';
import * as share from './share.js';
import { Sight } from './sight.js';
import { glossary, term } from './terms.js';
import { Tolerance } from './tolerance.js';
import { Toolbar } from './toolbar.js';
import { Views } from './views.js';

/** The page opens on the drive of this example, calculated by the default model, and tells what limits its torque if it is of steel. */
const FIRST_DRIVE = 'paper-5.1';
const STEEL_LIMITS = { allowable_stress_mpa: 1500, strength: '42crmo4-qt' };
/** Degrees of the input angle per second while it plays: a turn takes 20 seconds. */
const PLAY_SPEED = 18;
const MOST_TURNS = 3;
/** Between two pictures while it plays: more of them would take more than a third of a core. */
const FRAME_MS = 80;
/** Positions closer than this are alike. */
const ALIKE_DEG = 1e-6;
const ADDRESS_DELAY_MS = 400;
const ANNOUNCE_DELAY_MS = 700;
/** Only a calculation longer than this is worth a sign. */
const BUSY_DELAY_MS = 400;

const byId = (id) => document.getElementById(id);

const state = {
  design: undefined,
  /** The last result that could be drawn: `{ design, answers }`. */
  shown: undefined,
  reference: undefined,
  problems: [],
  reasons: [],
  findings: [],
  examples: [],
  /** Where the design comes from: `{ title, design }` of an example or a file, null of a design of its own. */
  origin: null,
  inputDeg: 0,
  selected: 3,
  from: 'ring',
  isPlaying: false,
  view: 'design',
};
let motion;
let gesture;
/** While it plays: when the last picture was drawn, and how far it still turns. */
let playing = {};

const history = new History();
const service = new Service({ onResult, onAway, onBusy, onSlow });

const form = new Form(byId('form'), {
  onEdit(design, pointer) {
    setDesign(design, { gesture: pointer, fromForm: true });
  },
  onEnd() {
    gesture = undefined;
    // What had to wait because it takes room or was out of sight.
    showFindings();
    showComparison();
    render();
  },
  onSearch(design) {
    find.askLike(design, state.shown?.answers);
    views.goTo('find');
  },
});

const mechanism = new Mechanism(
  { whole: byId('whole'), detail: byId('detail'), legend: byId('legend') },
  {
    onTurn(deg) {
      play(false);
      turnTo(deg);
    },
    onSelect: select,
    onDrawings: () => byId('downloads').showPopover(),
  },
);

const plots = new Plots(
  { abscissae: byId('abscissae'), contacts: byId('contacts'), charts: byId('charts'), readout: byId('readout') },
  (positionDeg) => {
    play(false);
    turnTo(motion.inputDegAt(state.selected, positionDeg, state.inputDeg));
  },
);

const results = new Results(
  { keyFigures: byId('key-figures'), table: byId('table') },
  showPeak,
  (pointer) => form.goTo(pointer),
  ({ pointer, value }) => setDesign(withVirtualWork(changed(state.design, pointer, value))),
);

const accuracy = new Accuracy(
  { panel: byId('accuracy'), measure: byId('measure'), wanted: byId('accuracy-wanted'), state: byId('accuracy-state'), list: byId('accuracy-list') },
  (design) => setDesign(design),
);

const losses = new Losses({ panel: byId('losses'), compare: byId('compare-losses'), state: byId('losses-state'), table: byId('losses-table') }, (design) => setDesign(design));

const drawings = new Drawings(
  { list: byId('drawings-list'), state: byId('drawings-state') },
  { nameOf: fileName, onRefusal: showNotes, onReport: () => window.print(), goTo: goToField, labelOf: (pointer) => form.labelOf(pointer) },
);

/** Parts that are far down the page. */
const sight = {
  mechanism: new Sight(byId('whole'), () => {}),
  plots: new Sight(byId('charts'), () => {
    showPlots();
    render();
  }),
  table: new Sight(byId('table'), () => showTable()),
};

// ---- the views

const quantities = new Quantities();
const takeDesign = (design, origin = state.origin) => {
  gesture = undefined;
  setDesign(design, { origin, respan: true });
};

/** Views of studies, each of which knows the design at hand. */
const studies = {
  explore: new Explore(byId('explore'), { quantities, onUse: (design) => takeDesign(design) }),
  sensitivity: new Sensitivity(byId('sensitivity'), { quantities, goTo: (pointer) => form.goTo(pointer) }),
  tolerance: new Tolerance(byId('tolerance'), { quantities }),
};

const views = new Views(byId('views'), (view, isFromAddress) => {
  if (view !== 'design') play(false);
  for (const [key, study] of Object.entries(studies)) study.show(key === view);
  if (isFromAddress || !state.design) state.view = view;
  else {
    // Each view is a step of the browser's history.
    writeAddress();
    state.view = view;
    window.history.pushState(null, '', address());
  }
});

const find = new Find(byId('find'), {
  quantities,
  onOpen(design, title) {
    takeDesign(design, { title, design });
    views.goTo('design');
  },
  onOpenBoth({ design, title }, reference) {
    keepReference({ design: reference.design, origin: reference });
    takeDesign(design, { title, design });
    views.goTo('design');
  },
});

// ---- the design

function setDesign(design, { gesture: newGesture, origin = state.origin, fromForm = false, respan = false, keepsAddress = false } = {}) {
  if (state.design && isSame(design, state.design)) return;
  if (state.design && !(newGesture && newGesture === gesture)) history.record(current());
  gesture = newGesture;
  replaceDesign(design, { origin, fromForm, respan, keepsAddress });
}

function replaceDesign(design, { origin, fromForm = false, respan = false, keepsAddress = false }) {
  state.design = design;
  state.origin = origin;
  form.setDesign(design, { respan: respan && !fromForm });
  accuracy.setDesign(design);
  losses.setDesign(design);
  drawings.setDesign(design);
  for (const study of Object.values(studies)) study.setDesign(design);
  service.request(design);
  setProperties(byId('undo'), { disabled: !history.canUndo });
  setProperties(byId('redo'), { disabled: !history.canRedo });
  showName();
  if (!keepsAddress) addressLater();
}

const current = () => ({ design: state.design, origin: state.origin });

function step(to) {
  if (to === undefined) return;
  gesture = undefined;
  replaceDesign(to.design, { origin: to.origin });
}

const undo = () => step(history.undo(current()));
const redo = () => step(history.redo(current()));

function nameOf(design, origin = state.origin) {
  const example = state.examples.find((candidate) => isSame(candidate.design, design));
  if (example) return example.title;
  if (!origin) return 'A design of your own';
  return isSame(design, origin.design) ? origin.title : `${origin.title} (changed)`;
}

function showName() {
  const name = nameOf(state.design);
  setText(byId('design-name'), name);
  document.title = `${name.split(':')[0]} – toothwave`;
  for (const { button, design } of state.examples) setAttributes(button, { 'aria-pressed': isSame(design, state.design) });
}

let addressTimer;
function addressLater() {
  clearTimeout(addressTimer);
  // Browsers take long over an address: not while a slider is held.
  addressTimer = setTimeout(() => (form.isHeld ? addressLater() : writeAddress()), ADDRESS_DELAY_MS);
}

function writeAddress() {
  clearTimeout(addressTimer);
  window.history.replaceState(null, '', address());
}

const address = () => share.toAddress(state.design, state.reference?.design, state.view);

// ---- what the service says

function onResult({ design, answers, problems, solveMs }) {
  state.problems = problems;
  state.reasons = reasonsOf(problems);
  const isDrawn = answers.geometry !== undefined;
  if (isDrawn) {
    state.shown = { design, answers };
    motion = new Motion(design, answers.geometry, answers.sweep);
    if (state.selected >= motion.installed) state.selected = 0;
    mechanism.setMotion(motion);
    setText(byId('solved'), `Solver ${answers.geometry.solver_version}, solved in ${number(solveMs, 2)} ms`);
  }
  state.findings = isDrawn ? findingsOf(answers) : [];
  document.body.classList.toggle('stale', !isDrawn);
  showNotes();
  showFindings();
  showReasons(isDrawn);
  showComparison();
  render();
  announce();
}

/** At the fields: what keeps the drive from existing, and what a drawing was refused for. */
function showNotes() {
  // Hints beside the fields stand on the last drive that could exist.
  form.setResult(state.shown?.answers ?? {}, reasonsOf([...state.problems, ...drawings.problems]), state.findings);
}

/** In the line under the key figures, which is always there: what takes room of its own would push the page about. */
function showReasons(isDrawn) {
  const banner = byId('impossible');
  setProperties(banner, { hidden: state.reasons.length === 0 });
  showStatus();
  if (banner.hidden) return;
  const [{ title }] = state.reasons;
  const kept = isDrawn ? 'Geometry is shown; forces are not.' : 'The last possible design stays in the picture.';
  const parts = state.reasons.map(({ pointer, detail }) => ({ pointer, text: pointer ? `${form.labelOf(pointer)}: ${detail}` : detail }));
  setText(byId('impossible-title'), `${title}.`);
  setText(byId('impossible-first'), parts.length > 1 ? `${parts[0].text}, and ${parts.length - 1} more` : parts[0].text);
  byId('impossible-all').replaceChildren(
    html('p', {}, state.shown ? kept : ''),
    html('ul', {}, parts.map(({ pointer, text }) => html('li', {}, pointer ? html('button', { type: 'button', class: 'link', onclick: () => form.goTo(pointer) }, text) : text))),
  );
}

/** What is told where there is nothing wrong. */
function showStatus() {
  const { findings, reasons } = state;
  const line = byId('status-findings');
  setProperties(line, { hidden: reasons.length > 0 });
  const count = findings.length === 1 ? '1 finding' : `${findings.length} findings`;
  setText(line, findings.length === 0 ? 'No findings' : `${count}: ${findings.map(titleOf).join(', ')}`);
  setProperties(line, { className: findings.some(({ severity }) => severity === 'warning') ? 'warning' : '' });
}

let busyTimer;
function onBusy(isBusy) {
  const figures = byId('key-figures');
  figures.setAttribute('aria-busy', String(isBusy));
  clearTimeout(busyTimer);
  if (isBusy) busyTimer = setTimeout(() => figures.classList.add('busy'), BUSY_DELAY_MS);
  else figures.classList.remove('busy');
}

function onSlow(seconds) {
  const line = byId('slow');
  setProperties(line, { hidden: seconds === undefined });
  if (seconds !== undefined) setText(line, `Calculating for ${fixed(seconds, 0)} s; numbers are the last design’s.`);
}

const findingNotes = new Map();

function findingNote(finding) {
  const text = JSON.stringify(finding);
  let note = findingNotes.get(finding.key);
  if (!note) {
    note = { element: html('details', {}, html('summary', {}, titleOf(finding))) };
    findingNotes.set(finding.key, note);
  }
  if (note.text !== text) {
    note.text = text;
    note.element.className = `note ${finding.severity}`;
    const parts = [explanation(finding, (pointer) => form.labelOf(pointer), (pointer) => form.goTo(pointer)), form.remedyButton(finding)].filter(Boolean);
    note.parts?.forEach((part) => part.remove());
    note.element.append(...(note.parts = parts));
  }
  return note.element;
}

const noFindings = html('p', { class: 'none' });

function showFindings() {
  const { findings } = state;
  // A list that grows under a held slider would push the table away; the line at the top says the same.
  if (form.isHeld) return;
  setText(noFindings, state.reasons.length > 0 ? 'The reasons why the design cannot exist come first.' : 'Nothing to report about this design.');
  setChildren(byId('findings'), findings.length > 0 ? findings.map(findingNote) : [noFindings]);
}

function showComparison() {
  const { reference, shown } = state;
  if (shown) results.updateKeyFigures(shown.answers, reference?.answers, form.isHeld);
  if (!form.isHeld || sight.plots.isSeen) showPlots();
  if (!form.isHeld || sight.table.isSeen) showTable();
  mechanism.setReference(reference);
  setProperties(byId('comparing'), { hidden: !reference });
  const differences = shown && reference ? inputDifferences(shown.design, reference.design) : [];
  showInputs(differences);
  if (!reference) return;
  setText(byId('reference-name'), reference.name);
  const text = differences.map(({ label, value, reference: other }) => `${label} ${other} → ${value}`).join(', ');
  setText(byId('differing'), differences.length > 0 ? `Inputs that differ: ${text}.` : 'All inputs are the same.');
}

/** The pass of a result, for the plots. */
function passOfResult(result) {
  if (!result?.answers.sweep) return undefined;
  result.pass ??= passOf(result.design, result.answers.sweep);
  return result.pass;
}

const showPlots = () => plots.setPasses(passOfResult(state.shown), passOfResult(state.reference));

function showTable() {
  const { shown, reference } = state;
  if (shown) results.updateTable(shown.answers, reference?.answers, form.isHeld);
}

let shownInputs = '[]';

/** Above the table of results: what the differences in it come from. It stands as long as it is the same: a press that begins on one
 *  of its buttons must end on it. */
function showInputs(differences) {
  const text = JSON.stringify(differences);
  if (form.isHeld || text === shownInputs) return;
  shownInputs = text;
  const head = ['Input', 'This design', 'Reference'].map((text, index) => html('th', { scope: 'col', class: index > 0 && 'numeric' }, text));
  const rows = differences.map(({ pointer, label, value, reference }) =>
    html(
      'tr',
      {},
      html('th', { scope: 'row' }, html('button', { type: 'button', class: 'link', onclick: () => form.goTo(pointer) }, label)),
      html('td', { class: 'numeric number' }, value),
      html('td', { class: 'numeric number' }, reference),
    ),
  );
  const table = [html('caption', {}, 'Inputs that differ from the reference'), html('thead', {}, html('tr', {}, head)), html('tbody', {}, rows)];
  byId('inputs').replaceChildren(...(differences.length > 0 ? table : []));
}

let announceTimer;
function announce() {
  clearTimeout(announceTimer);
  announceTimer = setTimeout(() => {
    const { reasons, findings } = state;
    const list = findings.map(titleOf).join(', ');
    setText(
      byId('announcer'),
      reasons.length > 0
        ? `${reasons[0].title}. ${reasons.map(({ pointer, detail }) => `${pointer ? `${form.labelOf(pointer)}: ` : ''}${detail}`).join('. ')}`
        : `Results are up to date. ${list ? `Findings: ${list}.` : 'No findings.'}`,
    );
  }, ANNOUNCE_DELAY_MS);
}

function onAway(away, detail) {
  const banner = byId('away');
  banner.hidden = !away;
  if (away) banner.replaceChildren(html('strong', {}, detail), ' Your design is kept; the page asks again until it answers.');
  else setText(byId('announcer'), 'The calculation service answers again.');
}

// ---- the reference

async function keepReference({ design, origin }, answers, { keepsAddress = false } = {}) {
  const name = nameOf(design, origin);
  const known = answers ?? (await evaluate(design).catch(() => ({ answers: {} }))).answers;
  if (!known.geometry) {
    setText(byId('announcer'), 'The reference could not be calculated.');
    return;
  }
  state.reference = { design, origin, name, answers: known, geometry: known.geometry };
  showComparison();
  render();
  if (!keepsAddress) addressLater();
}

function keepShown() {
  if (state.shown) keepReference({ design: state.shown.design, origin: state.origin }, state.shown.answers);
}

function clearReference() {
  state.reference = undefined;
  showComparison();
  render();
  addressLater();
  byId('keep').focus();
}

function swapReference() {
  const { design, origin } = state.reference;
  keepShown();
  setDesign(design, { origin, respan: true });
}

// ---- motion

const render = oncePerFrame(() => {
  if (!motion) return;
  const loaded = mechanism.render(state);
  if (!(form.isHeld || state.isPlaying) || sight.plots.isSeen) plots.drawTeeth(loaded, state.selected);
  const inTurn = ((state.inputDeg % 360) + 360) % 360;
  const angle = byId('angle');
  if (Number(angle.value) !== Math.round(inTurn * 10) / 10) angle.value = inTurn;
  const carrierDeg = motion.carrierDeg(state.inputDeg) % 360;
  setAttributes(angle, { 'aria-valuetext': `${fixed(inTurn, 1)} degrees, carrier ${fixed(carrierDeg, 2)} degrees` });
  const inputText = `${fixed(inTurn, 1)}°`;
  setText(byId('angle-input'), inputText);
  drawings.turnTo(state.inputDeg, inputText);
  setText(byId('angle-carrier'), `${fixed(carrierDeg, 2)}°`);
  setText(byId('tooth-name'), `Tooth ${state.selected}`);
  const tooth = loaded.find((candidate) => candidate.tooth === state.selected);
  setText(
    byId('tooth-state'),
    tooth
      ? `ψ ${fixed(tooth.positionDeg, 1)}°, σ up to ${fixed(Math.max(...Object.values(tooth.stress)), 0)} MPa`
      : `ψ ${fixed(motion.positionDeg(state.selected, state.inputDeg), 1)}°, no load`,
  );
  if (byId('teeth-table').open && !state.isPlaying) showTeeth(loaded);
});

function showTeeth(loaded) {
  const head = ['Tooth', 'ψ, deg', ...CONTACTS.map(({ index }) => `F ${index}, N`), ...CONTACTS.map(({ index }) => `σ ${index}, MPa`)];
  const row = ({ tooth, positionDeg, force, stress }) =>
    html(
      'tr',
      {},
      html('th', { scope: 'row' }, String(tooth)),
      [fixed(positionDeg, 2), ...CONTACTS.map(({ key }) => fixed(force[key], 1)), ...CONTACTS.map(({ key }) => fixed(stress[key], 1))].map((text) =>
        html('td', { class: 'numeric number' }, text),
      ),
    );
  byId('teeth').replaceChildren(
    html('thead', {}, html('tr', {}, head.map((text) => html('th', { scope: 'col', class: 'numeric' }, text)))),
    html('tbody', {}, loaded.map(row)),
  );
}

function turnTo(deg) {
  state.inputDeg = deg;
  render();
}

function select(tooth) {
  state.selected = ((tooth % motion.installed) + motion.installed) % motion.installed;
  render();
}

/** Turns the drive to where a peak stands and selects the tooth that carries it. */
function showPeak({ input_angle_deg: inputDeg, position_deg: positionDeg }) {
  play(false);
  const distance = (tooth) => Math.abs(motion.positionDeg(tooth, inputDeg) - positionDeg);
  // Of those that stand alike, on several lobes, the first.
  const teeth = [...Array(motion.installed).keys()];
  state.selected = teeth.reduce((best, tooth) => (distance(tooth) < distance(best) - ALIKE_DEG ? tooth : best));
  turnTo(inputDeg);
}

/** Stops by itself after three turns, and where nobody sees it. */
function advance() {
  const now = performance.now();
  if (playing.leftDeg <= 0 || document.hidden || !(sight.mechanism.isSeen || sight.plots.isSeen)) {
    play(false);
    return;
  }
  // A picture after a slow moment is not caught up with.
  const stepDeg = (Math.min(200, now - playing.lastMs) / 1000) * PLAY_SPEED;
  Object.assign(playing, { lastMs: now, leftDeg: playing.leftDeg - stepDeg });
  turnTo(state.inputDeg + stepDeg);
}

function play(isPlaying) {
  if (isPlaying === state.isPlaying) return;
  state.isPlaying = isPlaying;
  setText(byId('play'), isPlaying ? 'Pause' : 'Play');
  clearInterval(playing.timer);
  if (isPlaying) playing = { lastMs: performance.now(), leftDeg: 360 * MOST_TURNS, timer: setInterval(advance, FRAME_MS) };
  else render();
}

// ---- the tools

async function copy(text, button) {
  const label = button.textContent;
  let isDone = false;
  try {
    await navigator.clipboard.writeText(text);
    isDone = true;
  } catch {
    // Browsers give the clipboard only to secure origins; the old way works on the others.
    const area = html('textarea', { readonly: true, class: 'hidden', value: text });
    button.parentElement.append(area);
    area.select();
    isDone = document.execCommand('copy');
    area.remove();
    button.focus();
  }
  const message = isDone ? 'Copied' : 'Copying failed';
  setText(button, message);
  setText(byId('announcer'), message);
  setTimeout(() => setText(button, label), 1500);
}

/** Takes the document in a text, from a file of the name or, without one, as it was edited here. */
function applyText(text, fileName) {
  const error = byId('document-error');
  try {
    const read = share.fromText(text);
    const design = converted(read);
    setDesign(design, { origin: fileName === undefined ? state.origin : { title: share.titleOfFile(fileName), design }, respan: true });
    if (design !== read) notify(CONVERTED);
    error.hidden = true;
    byId('document').close();
  } catch (failure) {
    // The text is there to be mended.
    if (!byId('document').open) showDocument(text);
    error.hidden = false;
    setText(error, failure.message);
  }
}

function showDocument(text) {
  byId('document-text').value = text;
  byId('document-error').hidden = true;
  byId('document').showModal();
}

const notify = (text) => {
  byId('notice').hidden = false;
  setText(byId('notice-text'), text);
};

function showIntro(isShown, isRemembered) {
  byId('intro').hidden = !isShown;
  if (!isRemembered) return;
  try {
    if (isShown) localStorage.removeItem('intro');
    else localStorage.setItem('intro', 'hidden');
  } catch {
    // Storage may be forbidden; the page is then introduced each time.
  }
}

function isIntroWanted() {
  try {
    return localStorage.getItem('intro') !== 'hidden';
  } catch {
    return true;
  }
}

function askForKey(detail, isWrong) {
  const login = byId('login');
  login.hidden = false;
  setText(byId('login-detail'), isWrong ? 'This key opens nothing here.' : 'This service wants a key.');
  byId('login-key').focus();
  byId('login-key').select();
  setText(byId('announcer'), detail ?? '');
}

/** Named after the design: its title without what a file cannot be called, and, but for a ready one, what tells it from others of that
 *  title. */
function fileName(ending) {
  const title = document.title.replace(/ – toothwave$/, '').replace(/[’']/g, '');
  const isReady = state.examples.some(({ design }) => isSame(design, state.design));
  const own = isReady ? '' : `-${share.fingerprint(state.design)}`;
  return `${title.replace(/[^\w.]+/g, '-').replace(/^-|-$/g, '').toLowerCase()}${own}${ending}`;
}

function nextTheme() {
  const root = document.documentElement;
  const themes = ['system', 'light', 'dark'];
  const theme = themes[(themes.indexOf(root.dataset.theme ?? 'system') + 1) % themes.length];
  if (theme === 'system') delete root.dataset.theme;
  else root.dataset.theme = theme;
  try {
    localStorage.setItem('theme', theme);
  } catch {
    // Storage may be forbidden; the theme then lasts as long as the page.
  }
  showTheme();
}

function showTheme() {
  setText(byId('theme'), `Theme: ${document.documentElement.dataset.theme ?? 'auto'}`);
}

/** Leads to a field from within a menu. */
function goToField(pointer) {
  byId('downloads').hidePopover();
  views.goTo('design');
  form.goTo(pointer);
}

function listen() {
  const click = (id, action) => byId(id).addEventListener('click', action);
  click('undo', undo);
  click('redo', redo);
  click('keep', keepShown);
  click('clear', clearReference);
  click('swap', swapReference);
  click('copy-link', ({ currentTarget }) => {
    writeAddress();
    copy(location.href, currentTarget);
  });
  click('to-parts', () => goToField('/parts/wave_generator/bore_radius_mm'));
  click('more', ({ currentTarget }) => setAttributes(currentTarget, { 'aria-expanded': byId('table').classList.toggle('all') }));
  click('theme', nextTheme);
  click('play', () => play(!state.isPlaying));
  click('tooth-before', () => select(state.selected - 1));
  click('tooth-after', () => select(state.selected + 1));
  const zoomBy = (factor) => {
    mechanism.zoom = Math.min(8, Math.max(0.5, mechanism.zoom * factor));
    render();
  };
  click('zoom-in', () => zoomBy(Math.SQRT2));
  click('zoom-out', () => zoomBy(Math.SQRT1_2));
  click('open-document', () => showDocument(share.toText(state.design)));
  click('help', () => byId('help-dialog').showModal());
  click('help-close', () => byId('help-dialog').close());
  click('help-intro', () => {
    byId('help-dialog').close();
    showIntro(true, true);
    byId('intro').scrollIntoView({ block: 'start' });
  });
  click('intro-find', () => views.goTo('find'));
  click('intro-hide', () => showIntro(false, true));
  click('notice-hide', () => {
    byId('notice').hidden = true;
  });
  click('status-findings', () => byId('findings-title').scrollIntoView({ block: 'center' }));
  byId('login').addEventListener('submit', (event) => {
    event.preventDefault();
    byId('login').hidden = true;
    access.open(byId('login-key').value.trim());
    byId('login-key').value = '';
  });
  access.listen(askForKey);
  for (const menu of document.querySelectorAll('.menu')) {
    const opener = document.querySelector(`[popovertarget="${menu.id}"]`);
    menu.addEventListener('beforetoggle', () => {
      const { left, bottom } = opener.getBoundingClientRect();
      menu.style.setProperty('--left', `${left}px`);
      menu.style.setProperty('--top', `${Math.max(8, bottom + 4)}px`);
    });
  }
  // What only shows something new in its own place leaves the menu open. It closes first, so that the focus comes back to its button.
  byId('menu').addEventListener('click', ({ target }) => target.closest('#theme, #copy-link') ?? byId('menu').hidePopover(), true);
  byId('examples').addEventListener('click', () => byId('examples').hidePopover());
  // Their places are no part of the address, which is the design's.
  for (const link of document.querySelectorAll('.skip')) {
    link.addEventListener('click', (event) => {
      event.preventDefault();
      const target = document.querySelector(link.hash);
      target.focus({ preventScroll: true });
      target.scrollIntoView({ block: 'start' });
    });
  }
  new Toolbar(byId('tools'));
  click('document-close', () => byId('document').close());
  click('document-apply', () => applyText(byId('document-text').value));
  click('document-copy', ({ currentTarget }) => copy(byId('document-text').value, currentTarget));
  click('save', () => share.save(share.toFile(state.design), fileName('.json')));
  click('load', () => byId('document-file').click());
  byId('document-file').addEventListener('change', async ({ currentTarget: input }) => {
    const [file] = input.files;
    if (file) applyText(await file.text(), file.name);
    input.value = '';
  });
  byId('form').addEventListener('submit', (event) => event.preventDefault());
  byId('angle').addEventListener('input', ({ currentTarget }) => {
    play(false);
    // Whole turns are kept: the carrier has not come round yet when the wave generator has.
    turnTo(360 * Math.floor(state.inputDeg / 360) + Number(currentTarget.value));
  });
  byId('from').addEventListener('change', ({ currentTarget }) => {
    state.from = currentTarget.value;
    render();
  });
  byId('teeth-table').addEventListener('toggle', render);
  addEventListener('keydown', (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || document.querySelector('dialog[open]')) return;
    const key = event.key.toLowerCase();
    if (key === 'z' && !event.shiftKey) undo();
    else if (key === 'y' || key === 'z') redo();
    else return;
    event.preventDefault();
  });
  addEventListener('hashchange', () => fromAddress());
  addEventListener('beforeprint', () => {
    byId('findings-table').replaceChildren(...findingsTable(state.findings));
    byId('report').replaceChildren(...reportOf(...reported(), location.href));
    document.documentElement.classList.add('printing');
    plots.print(true);
  });
  addEventListener('afterprint', () => {
    document.documentElement.classList.remove('printing');
    plots.print(false);
  });
}

/** What is printed: the design that the numbers are about, or, where there are none, the one at hand and why. */
function reported() {
  const isStale = document.body.classList.contains('stale') || !state.shown;
  const design = isStale ? state.design : state.shown.design;
  const reasons = state.reasons.map(({ title, detail, pointer }) => ({ title, detail, label: pointer && form.labelOf(pointer) }));
  const version = isStale ? undefined : state.shown.answers.geometry.solver_version;
  return [nameOf(design), { design, version, reference: state.reference, reasons }];
}

/** Takes what the address holds; what cannot be read is told, and the address is left as it is, to be looked at. */
function fromAddress({ atStart = false } = {}) {
  // A place in the page is no design.
  if (location.hash && document.getElementById(location.hash.slice(1))) return false;
  const found = share.fromAddress(location.hash);
  const [design, reference] = [found.design, found.reference].map((read) => read && converted(read));
  const { view, broken } = found;
  views.show(view, true);
  if (broken.includes('design')) {
    const instead = atStart ? 'A ready design is shown instead' : 'Your design is kept';
    notify(`This link is damaged or was cut short: no design can be read from it. ${instead}; the address stays until you change something.`);
    return false;
  }
  if (broken.includes('reference')) notify('This link is damaged or was cut short: its design is shown, but the reference cannot be read from it.');
  if (reference && !isSame(reference, state.reference?.design)) keepReference({ design: reference, origin: null }, undefined, { keepsAddress: true });
  if (design !== found.design || reference !== found.reference) notify(CONVERTED);
  const example = design && state.examples.find((candidate) => isSame(candidate.design, design));
  if (design) setDesign(design, { origin: example ? originOf(example) : null, respan: true, keepsAddress: broken.length > 0 });
  return design !== undefined;
}

async function loadExamples() {
  const { examples } = await getJson('v1/examples');
  const loaded = await Promise.all(examples.map(async ({ name, title, href }) => ({ name, title, design: await getJson(href.slice(1)) })));
  const { drive, load } = (loaded.find(({ name }) => name === FIRST_DRIVE) ?? loaded[0]).design;
  const { allowable_stress_mpa, strength } = STEEL_LIMITS;
  const design = { drive, load: { ...load, allowable_stress_mpa }, parts: { carrier: { strength } } };
  return [{ name: 'first', title: 'First design: an ellipse with 28 rollers, default model', design }, ...loaded];
}

function showExamples() {
  for (const example of state.examples) {
    example.button = html('button', { type: 'button', 'data-example': example.name }, example.title);
    example.button.addEventListener('click', () => {
      gesture = undefined;
      setDesign(example.design, { origin: originOf(example), respan: true });
    });
    byId('examples').append(example.button);
  }
}

const originOf = ({ title, design }) => ({ title: title.split(':')[0], design });

async function start() {
  showTheme();
  showIntro(isIntroWanted(), false);
  byId('glossary').append(glossary());
  byId('position-term').append(term('position'));
  listen();
  while (state.examples.length === 0) {
    try {
      await quantities.load();
      state.examples = await loadExamples();
    } catch {
      if (byId('away').hidden && !access.isAsking()) onAway(true, 'The calculation service does not answer.');
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
  byId('away').hidden = true;
  showExamples();
  // Names save typing; without them the numbers can still be entered.
  getJson('v1/materials').then(({ materials }) => form.offerMaterials(materials), () => {});
  find.restore();
  if (!fromAddress({ atStart: true })) {
    const [first] = state.examples;
    setDesign(first.design, { origin: originOf(first), respan: true, keepsAddress: share.fromAddress(location.hash).broken.length > 0 });
  }
  byId('legend').querySelector('.ramp').style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map(stressColor).join(', ')})`;
  if (!matchMedia('(prefers-reduced-motion: reduce)').matches) play(true);
}

start();
