// @ts-check
/** Parts of a face that are picked where they are seen. */

/**
 * @param {import("./viewer.js").Viewer} viewer @param {HTMLElement} button that begins and ends it
 * @param {(place: number[]) => Promise<void>} pick told where, in px of the photo
 */
export function picking(viewer, button, pick) {
  const { viewport } = viewer.main;
  const show = (/** @type {boolean} */ on) => {
    button.setAttribute("aria-pressed", String(on));
    viewer.root.classList.toggle("picking", on);
  };
  button.addEventListener("click", () => show(!viewer.root.classList.contains("picking")));
  viewer.root.addEventListener("keydown", ({ key }) => key === "Escape" && show(false));
  viewer.main.root.addEventListener(
    "pointerdown",
    (event) => {
      if (!viewer.root.classList.contains("picking") || event.button !== 0) return;
      // Before the bar and the viewport, which would move.
      event.stopImmediatePropagation();
      event.preventDefault();
      const [x, y] = viewport.place(event);
      void pick(viewport.toPhoto(x, y));
    },
    { capture: true },
  );
  show(false);
}
