// A row of buttons that is one stop for the Tab key; arrow keys move within it.

export class Toolbar {
  constructor(element) {
    this.element = element;
    element.addEventListener('keydown', (event) => {
      const items = this.#items();
      const at = items.indexOf(document.activeElement);
      const next = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: items.length - 1 }[event.key];
      if (next === undefined || at < 0) return;
      event.preventDefault();
      items[(next + items.length) % items.length].focus();
    });
    element.addEventListener('focusin', ({ target }) => this.#stopAt(target));
    this.#stopAt(this.#items()[0]);
  }

  #items() {
    return [...this.element.querySelectorAll('button, a')].filter((item) => !item.disabled && item.checkVisibility());
  }

  #stopAt(item) {
    for (const other of this.element.querySelectorAll('button, a')) other.tabIndex = other === item ? 0 : -1;
  }
}
