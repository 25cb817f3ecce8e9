// What the page shows: one design, its answers, an input angle, a selected tooth and perhaps a reference. Everything on the page
// follows from these; each part of it is asked to show them, none keeps a second copy.

import * as access from './access.js';
import { Accuracy } from './accuracy.js';
import { copy } from './clipboard.js';
import { Comparison } from './comparison.js';
import { converted } from './convert.js';
import { isSame, withEstimate } from './design.js';
import { listenToDocument } from './document-dialog.js';
import { byId, oncePerFrame, setProperties, setText } from './dom.js';
import { Drawings } from './drawings.js';
import { showEffect } from './effect.js';
import { Examples, shortTitle } from './examples.js';
import { Explore } from './explore.js';
import { Find } from './find.js';
import { findingsOf, reasonsOf } from './findings.js';
import { FindingsList } from './findings-list.js';
import { Form } from './form.js';
import { number } from './format.js';
import { History } from './history.js';
import { listenToLogin } from './login.js';
import { Losses } from './losses.js';
import { learnMaterials, unpublished } from './materials.js';
import { Mechanism, stressColor } from './mechanism.js';
import { listenToMenus } from './menus.js';
import { Motion } from './motion.js';
import { passOf } from './pass.js';
import { Plots } from './plots.js';
import { listenToPreferences } from './preferences.js';
import { Quantities } from './quantities.js';
import { findingsTable, inputDifferences, reportOf } from './report.js';
import { Results } from './results.js';
import { Sensitivity } from './sensitivity.js';
import { Service, evaluate, getJson } from './service.js';
import * as share from './share.js';
import { Sight } from './sight.js';
import { Status } from './status.js';
import { glossary, term } from './terms.js';
import { small, t, writeTexts } from './texts.js';
import { Tiles } from './tiles.js';
import { Tolerance } from './tolerance.js';
import { Turning } from './turning.js';
import { Views } from './views.js';

const ADDRESS_DELAY_MS = 400;

writeTexts();

const state = {
  design: undefined,
  /** The last result that could be drawn: `{ design, answers }`. */
  shown: undefined,
  reference: undefined,
  problems: [],
  reasons: [],
  findings: [],
  assumptions: [],
  /** A finding whose remedy was applied, with the answers before: `{ finding, answers }`. */
  remedied: undefined,
  /** Where the design comes from: `{ title, design }` of an example or a file, null of a design of its own. */
  origin: null,
  view: 'design',
};
let motion;
let lastResult;
let gesture;

const history = new History();
const goTo = (pointer) => form.goTo(pointer);
const labelOf = (pointer) => form.labelOf(pointer);
const status = new Status({ labelOf, goTo });
const service = new Service({
  onResult,
  onAway: (isAway, detail) => status.away(isAway, detail),
  onBusy: (isBusy) => status.busy(isBusy),
  onSlow: (seconds) => status.slow(seconds),
});

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
  onRemedy(finding) {
    state.remedied = { finding, answers: state.shown.answers };
  },
  onSearch(design) {
    find.askLike(design, state.shown?.answers);
    views.goTo('find');
  },
});

const turning = new Turning({ onTurn: () => render(), isSeen: () => sight.mechanism.isSeen || sight.plots.isSeen });

const mechanism = new Mechanism(
  { whole: byId('whole'), detail: byId('detail'), legend: byId('legend') },
  { onTurn: (deg) => turning.stopAt(deg), onSelect: (tooth) => turning.select(tooth), onDrawings: () => byId('downloads').showPopover() },
);

const plots = new Plots({ abscissae: byId('abscissae'), contacts: byId('contacts'), charts: byId('charts'), readout: byId('readout') }, (positionDeg) => turning.stopAtPosition(positionDeg));

const tiles = new Tiles(byId('load-line'), byId('key-figures'));

const results = new Results(
  { table: byId('table'), more: byId('more') },
  (peak) => turning.stopAtPeak(peak),
  goTo,
  (contact, answers) => setDesign(withEstimate(state.design, contact, answers)),
);

const findingsList = new FindingsList(byId('findings'), { labelOf, goTo, remedyButton: (finding) => form.remedyButton(finding) });
const comparison = new Comparison(goTo);

const accuracy = new Accuracy(
  { panel: byId('accuracy'), measure: byId('measure'), wanted: byId('accuracy-wanted'), state: byId('accuracy-state'), list: byId('accuracy-list') },
  (design) => setDesign(design),
);

const losses = new Losses({ panel: byId('losses'), compare: byId('compare-losses'), state: byId('losses-state'), table: byId('losses-table') }, (design) => setDesign(design));

const drawings = new Drawings(
  { list: byId('drawings-list'), state: byId('drawings-state') },
  { nameOf: fileName, onRefusal: showNotes, onReport: () => window.print(), goTo: goToField, labelOf },
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
const examples = new Examples(takeDesign);

/** Views of studies, each of which knows the design at hand. */
const studies = {
  explore: new Explore(byId('explore'), { quantities, onUse: (design) => takeDesign(design) }),
  sensitivity: new Sensitivity(byId('sensitivity'), { quantities, goTo }),
  tolerance: new Tolerance(byId('tolerance'), { quantities }),
};

const views = new Views(byId('views'), (view, isFromAddress) => {
  if (view !== 'design') turning.play(false);
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

/** Another design, from elsewhere than the form. */
function takeDesign(design, origin = state.origin) {
  gesture = undefined;
  setDesign(design, { origin, respan: true });
}

function replaceDesign(design, { origin, fromForm = false, respan = false, keepsAddress = false }) {
  state.design = design;
  state.origin = origin;
  form.setDesign(design, { respan: respan && !fromForm });
  for (const part of [accuracy, losses, drawings, ...Object.values(studies)]) part.setDesign(design);
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
  const example = examples.find(design);
  if (example) return example.title;
  if (!origin) return t('design.own');
  return isSame(design, origin.design) ? origin.title : t('design.changed', { title: origin.title });
}

function showName() {
  const name = nameOf(state.design);
  setText(byId('design-name'), name);
  document.title = `${shortTitle(name)} – toothwave`;
  examples.mark(state.design);
}

/** A ready design has its title for itself. */
function fileName(ending) {
  return share.fileNameOf(shortTitle(nameOf(state.design)), ending, examples.find(state.design) ? undefined : state.design);
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

/** Takes what the address holds; what cannot be read is told, and the address is left as it is, to be looked at. */
function fromAddress({ atStart = false } = {}) {
  // A place in the page is no design.
  if (location.hash && document.getElementById(location.hash.slice(1))) return false;
  const found = share.fromAddress(location.hash);
  const [design, reference] = [found.design, found.reference].map((read) => read && converted(read));
  const { view, broken } = found;
  views.show(view, true);
  if (broken.includes('design')) {
    status.notify(atStart ? t('address.broken_at_start') : t('address.broken'));
    return false;
  }
  if (broken.includes('reference')) status.notify(t('address.broken_reference'));
  if (reference && !isSame(reference, state.reference?.design)) keepReference({ design: reference, origin: null }, undefined, { keepsAddress: true });
  if (design !== found.design || reference !== found.reference) status.notify(t('address.converted'));
  const example = design && examples.find(design);
  if (design) setDesign(design, { origin: example ? examples.originOf(example) : null, respan: true, keepsAddress: broken.length > 0 });
  return design !== undefined;
}

// ---- what the service says

function onResult({ design, answers, problems, solveMs }) {
  lastResult = { design, answers, problems, solveMs };
  state.problems = problems;
  state.reasons = reasonsOf(problems);
  const isDrawn = answers.geometry !== undefined;
  if (isDrawn) {
    state.shown = { design, answers };
    motion = new Motion(design, answers.geometry, answers.sweep);
    turning.setMotion(motion);
    mechanism.setMotion(motion);
    setText(byId('solved'), t('results.solved', { version: answers.geometry.solver_version, ms: number(solveMs, 2) }));
  }
  state.findings = isDrawn ? findingsOf(answers) : [];
  state.assumptions = isDrawn ? unpublished(design) : [];
  document.body.classList.toggle('stale', !isDrawn);
  showNotes();
  showFindings();
  showEffect(isDrawn ? state.remedied : undefined, state.findings, answers);
  state.remedied = undefined;
  const kept = isDrawn ? t('status.geometry_only') : t('status.last_design');
  status.show(state, state.shown ? kept : '');
  showComparison();
  render();
}

/** At the fields: what keeps the drive from existing, and what a drawing was refused for. */
function showNotes() {
  // Hints beside the fields stand on the last drive that could exist.
  form.setResult(state.shown?.answers ?? {}, reasonsOf([...state.problems, ...drawings.problems]), state.findings);
}

/** A list that grows under a held slider would push the table away; the line at the top says the same. */
function showFindings() {
  if (!form.isHeld) findingsList.show(state.findings, state.reasons.length > 0, state.assumptions);
}

function showComparison() {
  const { reference, shown } = state;
  if (shown) tiles.update(shown.answers, reference?.answers, form.isHeld);
  if (!form.isHeld || sight.plots.isSeen) showPlots();
  if (!form.isHeld || sight.table.isSeen) showTable();
  mechanism.setReference(reference);
  comparison.show(reference && { ...reference, name: referenceName() }, shown && reference ? inputDifferences(shown.design, reference.design) : [], form.isHeld);
}

/** A reference that has the name of the design is told apart by its inputs. */
function referenceName() {
  const { reference, shown } = state;
  const differences = inputDifferences(shown?.design ?? state.design, reference.design);
  if (reference.name !== nameOf(state.design) || differences.length === 0) return reference.name;
  const [{ label, reference: value }] = differences;
  return t('comparison.named', { name: reference.name, label: small(label), value });
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
  if (shown) results.update(shown.answers, reference?.answers, form.isHeld);
}

const render = oncePerFrame(() => {
  if (!motion) return;
  const loaded = mechanism.render(turning);
  if (!(form.isHeld || turning.isPlaying) || sight.plots.isSeen) plots.drawTeeth(loaded, turning.selected);
  turning.show(loaded);
  drawings.turnTo(turning.inputDeg, turning.angleInWords);
});

// ---- the reference

async function keepReference({ design, origin }, answers, { keepsAddress = false } = {}) {
  const name = nameOf(design, origin);
  const known = answers ?? (await evaluate(design).catch(() => ({ answers: {} }))).answers;
  if (!known.geometry) {
    status.say(t('comparison.failed'));
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
  byId('keep').focus({ preventScroll: true });
}

function swapReference() {
  const { design, origin } = state.reference;
  keepShown();
  setDesign(design, { origin, respan: true });
}

// ---- paper

/** What is printed: the design that the numbers are about, or, where there are none, the one at hand and why. */
function reported() {
  const isStale = document.body.classList.contains('stale') || !state.shown;
  const design = isStale ? state.design : state.shown.design;
  const reasons = state.reasons.map(({ title, detail, pointer }) => ({ title, detail, label: pointer && labelOf(pointer) }));
  const version = isStale ? undefined : state.shown.answers.geometry.solver_version;
  return [nameOf(design), { design, version, reference: state.reference && referenceName(), reasons }];
}

function print(isPrinting) {
  if (isPrinting) {
    byId('findings-table').replaceChildren(...findingsTable(state.findings));
    byId('report').replaceChildren(...reportOf(...reported(), location.href));
  }
  turning.print(isPrinting);
  if (isPrinting && motion) turning.show(mechanism.render(turning));
  document.documentElement.classList.toggle('printing', isPrinting);
  plots.print(isPrinting);
}

// ---- the start

/** Leads to a field from within a menu. */
function goToField(pointer) {
  byId('downloads').hidePopover();
  views.goTo('design');
  goTo(pointer);
}

function listenToKeys(event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey || document.querySelector('dialog[open]')) return;
  const key = event.key.toLowerCase();
  if (key === 'z' && !event.shiftKey) undo();
  else if (key === 'y' || key === 'z') redo();
  else return;
  event.preventDefault();
}

function zoomBy(factor) {
  mechanism.zoom = Math.min(8, Math.max(0.5, mechanism.zoom * factor));
  render();
}

function listen() {
  listenToMenus();
  listenToPreferences(() => state.design && writeAddress());
  listenToLogin();
  listenToDocument({
    design: () => state.design,
    nameOf: fileName,
    onTake(design, { title, isConverted }) {
      setDesign(design, { origin: title === undefined ? state.origin : { title, design }, respan: true });
      if (isConverted) status.notify(t('address.converted'));
    },
  });
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
  click('to-table', () => byId('table-title').scrollIntoView({ block: 'start' }));
  click('to-parts', () => goToField('/parts/wave_generator/bore_radius_mm'));
  click('zoom-in', () => zoomBy(Math.SQRT2));
  click('zoom-out', () => zoomBy(Math.SQRT1_2));
  click('intro-find', () => views.goTo('find'));
  click('notice-hide', () => setProperties(byId('notice'), { hidden: true }));
  click('status-findings', () => byId('findings-title').scrollIntoView({ block: 'center' }));
  byId('form').addEventListener('submit', (event) => event.preventDefault());
  addEventListener('keydown', listenToKeys);
  addEventListener('hashchange', () => fromAddress());
  addEventListener('beforeprint', () => print(true));
  addEventListener('afterprint', () => print(false));
}

/** Waits for the service, however long it is away. */
async function load() {
  while (!examples.isLoaded) {
    try {
      await quantities.load();
      await examples.load();
    } catch {
      if (byId('away').hidden && !access.isAsking()) status.away(true, t('service.silent'));
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
  byId('away').hidden = true;
  examples.offer();
}

function offerMaterials(served) {
  learnMaterials(served);
  form.offerMaterials();
  if (lastResult) onResult(lastResult);
}

async function start() {
  byId('glossary').append(glossary());
  byId('position-term').append(term('position'));
  listen();
  await load();
  // Names save typing; without them the numbers can still be entered.
  getJson('v1/materials').then(offerMaterials, () => {});
  find.restore();
  if (!fromAddress({ atStart: true })) {
    const { first } = examples;
    setDesign(first.design, { origin: examples.originOf(first), respan: true, keepsAddress: share.fromAddress(location.hash).broken.length > 0 });
  }
  byId('legend').querySelector('.ramp').style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map(stressColor).join(', ')})`;
  if (!matchMedia('(prefers-reduced-motion: reduce)').matches) turning.play(true);
}

start();
