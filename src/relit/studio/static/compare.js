// @ts-check
/** Before and after in one picture, with a bar between them that pointer and keyboard move. */

/**
 * @param {HTMLElement} figure holding `.after` over the picture before, and `[role=slider]`
 * @param {(event: PointerEvent) => boolean} [takes] whether a press moves the bar
 */
export function comparison(figure, takes = () => true) {
  const after = /** @type {HTMLElement} */ (figure.querySelector(".after"));
  const bar = /** @type {HTMLElement} */ (figure.querySelector("[role=slider]"));
  let share = 50;
  /** @type {number | null} the pointer that has the bar */
  let held = null;

  /** @param {number} to percent of the width that shows the photo before */
  const show = (to) => {
    share = Math.min(Math.max(to, 0), 100);
    after.style.clipPath = `inset(0 0 0 ${share}%)`;
    bar.style.left = `${share}%`;
    bar.setAttribute("aria-valuenow", String(Math.round(share)));
    bar.setAttribute("aria-valuetext", `${Math.round(share)} % before, ${Math.round(100 - share)} % after`);
  };

  /** @param {PointerEvent} event */
  const follow = (event) => {
    const box = figure.getBoundingClientRect();
    show(((event.clientX - box.left) / box.width) * 100);
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
}
