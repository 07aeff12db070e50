// @ts-check
/** One frame with pictures of the same photo over each other, that are zoomed and moved together. */

import { Viewport } from "./viewport.js";

const STEP = 40; // CSS px that an arrow key moves the picture by

export class Pane {
  /** @param {HTMLElement} root @param {HTMLElement[]} layers in it, each of which holds pictures */
  constructor(root, layers) {
    this.root = root;
    this.layers = layers;
    this.viewport = new Viewport(root);
    this.viewport.addEventListener("change", () => this.place());
    root.addEventListener("pointerdown", (event) => this.#press(event));
    root.addEventListener("pointermove", (event) => this.#pan(event));
    root.addEventListener("dblclick", (event) => this.toggle(...this.viewport.place(event)));
    root.addEventListener("keydown", (event) => this.#key(event));
    // One finger scrolls the page past a picture that is all in sight; two zoom it.
    const zooms = (/** @type {TouchEvent} */ event) => event.touches.length > 1 && event.preventDefault();
    root.addEventListener("touchstart", zooms, { passive: false });
  }

  /** Where the photo begins and ends, in shares of the frame's width. */
  get span() {
    const { x, width, scale } = this.viewport;
    const frame = this.root.clientWidth || 1;
    return [Math.max(x / frame, 0), Math.min((x + width * scale) / frame, 1)];
  }

  /** Show a device px for each of the photo. @param {number} [x] what stays in place @param {number} [y] */
  actual(x, y) {
    const { viewport } = this;
    const { clientWidth, clientHeight } = this.root;
    const [atX, atY] = [x ?? clientWidth / 2, y ?? clientHeight / 2];
    const scale = 1 / window.devicePixelRatio;
    viewport.x = atX - ((atX - viewport.x) * scale) / viewport.scale;
    viewport.y = atY - ((atY - viewport.y) * scale) / viewport.scale;
    // A photo that is smaller than the frame is then smaller than when it is fitted.
    viewport.scale = scale;
    viewport.pan(0, 0);
  }

  /** From all of the photo to its pixels, and back. @param {number} [x] @param {number} [y] */
  toggle(x, y) {
    if (this.viewport.fitted) this.actual(x, y);
    else this.viewport.fit();
  }

  /** Show what another pane of the same size shows. @param {Pane} other */
  follow(other) {
    const { x, y, scale, fitted, width, height } = other.viewport;
    Object.assign(this.viewport, { x, y, scale, fitted, width, height, box: [0, 0, width, height] });
    this.place();
  }

  /** Put the pictures where the viewport says. */
  place() {
    const { x, y, scale, width, height, fitted } = this.viewport;
    this.root.classList.toggle("zoomed", !fitted);
    for (const picture of /** @type {HTMLElement[]} */ (this.layers.flatMap((layer) => [...layer.children]))) {
      picture.style.width = `${width}px`;
      picture.style.height = `${height}px`;
      picture.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
      picture.style.imageRendering = scale > 6 ? "pixelated" : "auto";
    }
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const { viewport, root } = this;
    this.panning = null;
    if (viewport.pinched) {
      // A second finger ends what the first began.
      for (const finger of viewport.fingers.keys()) root.hasPointerCapture(finger) && root.releasePointerCapture(finger);
      return;
    }
    // The bar takes its own.
    if (event.defaultPrevented || viewport.fitted || ![0, 1].includes(event.button)) return;
    event.preventDefault();
    root.focus({ preventScroll: true });
    root.setPointerCapture(event.pointerId);
    this.panning = { id: event.pointerId, at: viewport.place(event) };
  }

  /** @param {PointerEvent} event */
  #pan(event) {
    if (this.panning?.id !== event.pointerId || !this.root.hasPointerCapture(event.pointerId)) return;
    const [x, y] = this.viewport.place(event);
    this.viewport.pan(x - this.panning.at[0], y - this.panning.at[1]);
    this.panning.at = [x, y];
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const { viewport } = this;
    /** @type {Record<string, () => void>} */
    const acts = {
      "+": () => viewport.zoom(1.25),
      "=": () => viewport.zoom(1.25),
      "-": () => viewport.zoom(0.8),
      0: () => viewport.fit(),
      1: () => this.actual(),
      ArrowLeft: () => viewport.pan(STEP, 0),
      ArrowRight: () => viewport.pan(-STEP, 0),
      ArrowUp: () => viewport.pan(0, STEP),
      ArrowDown: () => viewport.pan(0, -STEP),
    };
    const act = acts[event.key];
    // A picture that is all in sight has nowhere to go, and the arrows scroll the page.
    if (!act || (viewport.fitted && event.key.startsWith("Arrow"))) return;
    event.preventDefault();
    act();
  }
}
