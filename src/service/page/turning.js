// How the drive stands in the picture: its input angle, the selected tooth, from where it is seen, and how it plays.

import { byId, html, setAttributes, setText } from './dom.js';
import { fixed } from './format.js';
import { CONTACTS } from './motion.js';
import { t } from './texts.js';

/** Degrees of the input angle per second while it plays: a turn takes 20 seconds. */
const PLAY_SPEED = 18;
const MOST_TURNS = 3;
/** Between two pictures while it plays: more of them would take more than a third of a core. */
const FRAME_MS = 80;
/** Positions closer than this are alike. */
const ALIKE_DEG = 1e-6;

export class Turning {
  inputDeg = 0;
  selected = 3;
  from = 'ring';
  isPlaying = false;
  #motion;
  /** The tooth that is selected again after printing. */
  #onScreen;
  /** While it plays: when the last picture was drawn, and how far it still turns. */
  #playing = {};

  /** `onTurn()` when it stands otherwise; it plays as long as `isSeen()`. */
  constructor({ onTurn, isSeen }) {
    Object.assign(this, { onTurn, isSeen });
    this.#listen();
  }

  setMotion(motion) {
    this.#motion = motion;
    if (this.selected >= motion.installed) this.selected = 0;
  }

  turnTo(deg) {
    this.inputDeg = deg;
    this.onTurn();
  }

  /** As somebody wants it, who then looks at it. */
  stopAt(deg) {
    this.play(false);
    this.turnTo(deg);
  }

  /** To where the selected tooth stands at a position. */
  stopAtPosition(positionDeg) {
    this.stopAt(this.#motion.inputDegAt(this.selected, positionDeg, this.inputDeg));
  }

  /** To where a peak stands, with the tooth selected that carries it. */
  stopAtPeak({ input_angle_deg: inputDeg, position_deg: positionDeg }) {
    const distance = (tooth) => Math.abs(this.#motion.positionDeg(tooth, inputDeg) - positionDeg);
    // Of those that stand alike, on several lobes, the first.
    const teeth = [...Array(this.#motion.installed).keys()];
    this.selected = teeth.reduce((best, tooth) => (distance(tooth) < distance(best) - ALIKE_DEG ? tooth : best));
    this.stopAt(inputDeg);
  }

  select(tooth) {
    const { installed } = this.#motion;
    this.selected = ((tooth % installed) + installed) % installed;
    this.onTurn();
  }

  /** A reader of paper cannot choose a tooth: it shows the most loaded one, and the screen then the selected one again. */
  print(isPrinting) {
    if (isPrinting && this.#motion) {
      const largest = ({ stress }) => Math.max(...Object.values(stress));
      const [most] = this.#motion.loaded(this.inputDeg).sort((one, other) => largest(other) - largest(one));
      this.#onScreen ??= this.selected;
      if (most) this.select(most.tooth);
    } else if (this.#onScreen !== undefined) {
      this.select(this.#onScreen);
      this.#onScreen = undefined;
    }
  }

  play(isPlaying) {
    if (isPlaying === this.isPlaying) return;
    this.isPlaying = isPlaying;
    setText(byId('play'), isPlaying ? t('mechanism.pause') : t('mechanism.play'));
    clearInterval(this.#playing.timer);
    if (isPlaying) this.#playing = { lastMs: performance.now(), leftDeg: 360 * MOST_TURNS, timer: setInterval(() => this.#advance(), FRAME_MS) };
    else this.onTurn();
  }

  /** Stops by itself after three turns, and where nobody sees it. */
  #advance() {
    const now = performance.now();
    if (this.#playing.leftDeg <= 0 || document.hidden || !this.isSeen()) {
      this.play(false);
      return;
    }
    // A picture after a slow moment is not caught up with.
    const stepDeg = (Math.min(200, now - this.#playing.lastMs) / 1000) * PLAY_SPEED;
    Object.assign(this.#playing, { lastMs: now, leftDeg: this.#playing.leftDeg - stepDeg });
    this.turnTo(this.inputDeg + stepDeg);
  }

  get #inTurn() {
    return ((this.inputDeg % 360) + 360) % 360;
  }

  /** Whole turns count, so that the angles of both shafts have the ratio. */
  get angleInWords() {
    return `${fixed(this.inputDeg, 1)}°`;
  }

  /** Writes angles and the selected tooth; `loaded` are the loaded teeth. */
  show(loaded) {
    const angle = byId('angle');
    if (Number(angle.value) !== Math.round(this.#inTurn * 10) / 10) angle.value = this.#inTurn;
    const carrierDeg = this.#motion.carrierDeg(this.inputDeg);
    setAttributes(angle, { 'aria-valuetext': t('mechanism.angle_in_words', { input: fixed(this.inputDeg, 1), carrier: fixed(carrierDeg, 2) }) });
    setText(byId('angle-input'), this.angleInWords);
    setText(byId('angle-carrier'), `${fixed(carrierDeg, 2)}°`);
    setText(byId('tooth-name'), t('mechanism.tooth', { tooth: this.selected }));
    const tooth = loaded.find((candidate) => candidate.tooth === this.selected);
    const position = fixed(tooth?.positionDeg ?? this.#motion.positionDeg(this.selected, this.inputDeg), 1);
    setText(byId('tooth-state'), tooth ? t('mechanism.loaded', { position, stress: fixed(Math.max(...Object.values(tooth.stress)), 0) }) : t('mechanism.unloaded', { position }));
    if (byId('teeth-table').open && !this.isPlaying) showTeeth(loaded);
  }

  #listen() {
    const click = (id, action) => byId(id).addEventListener('click', action);
    click('play', () => this.play(!this.isPlaying));
    click('tooth-before', () => this.select(this.selected - 1));
    click('tooth-after', () => this.select(this.selected + 1));
    byId('angle').addEventListener('input', ({ currentTarget }) => {
      // Whole turns are kept: the carrier has not come round yet when the wave generator has.
      this.stopAt(360 * Math.floor(this.inputDeg / 360) + Number(currentTarget.value));
    });
    byId('from').addEventListener('change', ({ currentTarget }) => {
      this.from = currentTarget.value;
      this.onTurn();
    });
    byId('teeth-table').addEventListener('toggle', () => this.onTurn());
  }
}

function showTeeth(loaded) {
  const head = [t('teeth.tooth'), 'ψ, deg', ...CONTACTS.map(({ index }) => `F ${index}, N`), ...CONTACTS.map(({ index }) => `σ ${index}, MPa`)];
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
