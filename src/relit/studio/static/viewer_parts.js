// @ts-check
/** What the viewer is made of, and what stands on it. */

/** @typedef {"after" | "slider" | "side"} Mode */

const MODES = { after: "After", slider: "Slider", side: "Side by side" };

const PARTS = `
  <div class="panes">
    <div class="pane twin" tabindex="0" role="application" aria-label="The photo before" hidden>
      <div class="layer"></div><span class="tag left">Before</span>
    </div>
    <div class="pane main" tabindex="0" role="application" aria-label="The photo"
      aria-keyshortcuts="+ - 0 1 B" title="+ and − zoom, 0 fits, 1 is 100 %, arrows move, B held shows before">
      <div class="layer before"></div>
      <div class="layer after"></div>
      <span class="tag left">Before</span><span class="tag right">After</span>
      <div role="slider" tabindex="0" class="handle" aria-label="Before and after" aria-valuemin="0" aria-valuemax="100"></div>
    </div>
  </div>
  <div class="viewer-bar">
    <div class="joined" role="group" aria-label="Compare">
      ${Object.entries(MODES).map(([mode, name]) => `<button type="button" data-mode="${mode}">${name}</button>`).join("")}
    </div>
    <button type="button" data-do="hold" aria-pressed="false" title="Hold this, or the key B or \\, to see the photo before">Hold: before</button>
    <div class="joined zooms" role="group" aria-label="Zoom">
      <button type="button" data-do="out" aria-label="Zoom out">−</button>
      <button type="button" data-do="in" aria-label="Zoom in">+</button>
      <button type="button" data-do="fit">Fit</button>
      <button type="button" data-do="actual" title="A pixel of the photo for each of the screen">100 %</button>
    </div>
    <span class="zoom"></span>
    <span class="grip" draggable="true" aria-hidden="true" title="Drag the preview out of the page, as a file; Export gives the photo in full resolution">⠿ Drag preview out</span>
    <div class="histogram">
      <button type="button" data-end="low" aria-pressed="false"></button>
      <canvas width="256" height="64" role="img"></canvas>
      <button type="button" data-end="high" aria-pressed="false"></button>
    </div>
  </div>`;

/** Fill an element, and return how its parts are found. @param {HTMLElement} root */
export function build(root) {
  root.classList.add("viewer");
  root.innerHTML = PARTS;
  return (/** @type {string} */ selector) => /** @type {any} */ (root.querySelector(selector));
}
