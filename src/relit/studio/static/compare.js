// @ts-check
/** Before and after in one picture, with a bar between them that pointer and keyboard move. */

/**
 * Return how the bar is put anew where `span` has changed.
 * @param {HTMLElement} figure holding `.after` over the picture before, and `[role=slider]`
 * @param {(event: PointerEvent) => boolean} [takes] whether a press moves the bar
 * @param {() => number[]} [span] where the picture begins and ends, in shares of the figure's width
 */
export function comparison(figure, takes = () => true, span = () => [0, 1]) {
  const after = /** @type {HTMLElement} */ (figure.querySelector(".after"));
  const bar = /** @type {HTMLElement} */ (figure.querySelector("[role=slider]"));
  let share = 50;
  /** @type {number | null} the pointer that has the bar */
  let held = null;

  const place = () => {
    const [from, to] = span();
    const left = 100 * from + share * (to - from);
    after.style.clipPath = `inset(0 0 0 ${left}%)`;
    bar.style.left = `${left}%`;
  };

  /** @param {number} to percent of the picture's width that show the photo before */
  const show = (to) => {
    share = Math.min(Math.max(to, 0), 100);
    place();
    bar.setAttribute("aria-valuenow", String(Math.round(share)));
    bar.setAttribute("aria-valuetext", `${Math.round(share)} % before, ${Math.round(100 - share)} % after`);
  };

  /** @param {PointerEvent} event */
  const follow = (event) => {
    const box = figure.getBoundingClientRect();
    const [from, to] = span();
    show((((event.clientX - box.left) / box.width - from) / (to - from)) * 100);
  };

  figure.addEventListener("pointerdown", (event) => {
    held = null;
    if (event.button !== 0 || !takes(event)) return;
    event.preventDefault();
    bar.focus({ preventScroll: true });
    held = event.pointerId;
    figure.setPointerCapture(held);
    follow(event);
  });
  figure.addEventListener("pointermove", (event) => {
    if (held === event.pointerId && figure.hasPointerCapture(held)) follow(event);
  });
  bar.addEventListener("keydown", (event) => {
    const far = event.shiftKey ? 10 : 2;
    /** @type {Record<string, number>} */
    const to = {
      ArrowLeft: share - far,
      ArrowDown: share - far,
      ArrowRight: share + far,
      ArrowUp: share + far,
      PageDown: share - 10,
      PageUp: share + 10,
      Home: 0,
      End: 100,
    };
    if (!(event.key in to)) return;
    event.preventDefault();
    show(to[event.key]);
  });
  show(share);
  return place;
}
