// What is in sight: the rest can wait while a slider is held or the drive turns.

/** How near to the screen counts as seen, so that what is scrolled to stands there when it comes. */
const NEAR = '100px';

export class Sight {
  isSeen = true;

  /** `onCome()` each time that the element comes into sight. */
  constructor(element, onCome) {
    new IntersectionObserver(
      (entries) => {
        this.isSeen = entries.at(-1).isIntersecting;
        if (this.isSeen) onCome();
      },
      { rootMargin: NEAR },
    ).observe(element);
  }
}
