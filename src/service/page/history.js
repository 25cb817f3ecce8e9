// Undo and redo over whole documents, with where each came from: they are small and never changed in place.

const MOST_STEPS = 200;

export class History {
  #past = [];
  #future = [];

  /** Remembers the `{ design, origin }` that is about to be replaced. */
  record(current) {
    this.#past.push(current);
    if (this.#past.length > MOST_STEPS) this.#past.shift();
    this.#future = [];
  }

  undo(current) {
    if (this.#past.length === 0) return undefined;
    this.#future.push(current);
    return this.#past.pop();
  }

  redo(current) {
    if (this.#future.length === 0) return undefined;
    this.#past.push(current);
    return this.#future.pop();
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }
}
