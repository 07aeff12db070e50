// @ts-check
/** Zoom and pan of one picture in its frame: a scale and an offset, in CSS px of the frame. */

const CLOSEST = 40; // CSS px that a photo's pixel may take

export class Viewport extends EventTarget {
  /** @param {HTMLElement} frame */
  constructor(frame) {
    super();
    this.frame = frame;
    this.width = this.height = 1;
    this.scale = 1;
    this.x = this.y = 0;
    this.fitted = true;
    /** @type {number[]} left, top, width and height of what is shown while it is fitted */
    this.box = [0, 0, 1, 1];
    new ResizeObserver(() => (this.fitted ? this.fit(this.box) : this.#changed())).observe(frame);
    frame.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    /** @type {Map<number, number[]>} pointer → place of each finger that is down */
    this.fingers = new Map();
    frame.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") this.fingers.set(event.pointerId, this.place(event));
    });
    frame.addEventListener("pointermove", (event) => this.#finger(event));
    for (const type of ["pointerup", "pointercancel"]) {
      // A finger may be lifted anywhere.
      window.addEventListener(type, (event) => this.fingers.delete(/** @type {PointerEvent} */ (event).pointerId));
    }
  }

  /** Whether two fingers zoom and move the picture now. */
  get pinched() {
    return this.fingers.size > 1;
  }

  /** Where something happened, in px of the frame. @param {{clientX: number, clientY: number}} event */
  place(event) {
    const box = this.frame.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /**
   * Show a photo: the part of it where the points are, with as much again around, or all of it.
   * @param {number} width @param {number} height @param {(number[] | null)[]} points
   */
  show(width, height, points) {
    [this.width, this.height] = [width, height];
    const given = /** @type {number[][]} */ (points.filter(Boolean));
    if (given.length < 3) return this.fit();
    const [from, to] = [Math.min, Math.max].map((end) => [0, 1].map((axis) => end(...given.map((at) => at[axis]))));
    const margin = Math.max(to[0] - from[0], to[1] - from[1]) / 4;
    return this.fit([from[0] - margin, from[1] - margin, to[0] - from[0] + 2 * margin, to[1] - from[1] + 2 * margin]);
  }

  /** Show the whole photo, or a box of it. @param {number[]} box */
  fit(box = [0, 0, this.width, this.height]) {
    const { clientWidth, clientHeight } = this.frame;
    const [left, top, width, height] = box;
    this.scale = Math.min(clientWidth / width, clientHeight / height) || 1;
    this.x = clientWidth / 2 - (left + width / 2) * this.scale;
    this.y = clientHeight / 2 - (top + height / 2) * this.scale;
    this.box = box;
    this.fitted = true;
    this.#changed();
  }

  /**
   * @param {number} factor
   * @param {number} [x] what stays in place, in px of the frame
   * @param {number} [y]
   */
  zoom(factor, x = this.frame.clientWidth / 2, y = this.frame.clientHeight / 2) {
    const scale = Math.min(Math.max(this.scale * factor, this.#whole()), CLOSEST);
    if (scale <= this.#whole()) return this.fit();
    this.x = x - ((x - this.x) * scale) / this.scale;
    this.y = y - ((y - this.y) * scale) / this.scale;
    this.scale = scale;
    this.fitted = false;
    return this.#changed();
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.x += dx;
    this.y += dy;
    this.fitted = false;
    this.#changed();
  }

  /** From px of the photo, whose pixel centres are at integers. @param {number[]} point */
  toFrame([x, y]) {
    return [(x + 0.5) * this.scale + this.x, (y + 0.5) * this.scale + this.y];
  }

  /** @param {number} x @param {number} y */
  toPhoto(x, y) {
    const inside = (/** @type {number} */ at, /** @type {number} */ size) =>
      Math.round(Math.min(Math.max(at - 0.5, 0), size - 1) * 100) / 100;
    return [inside((x - this.x) / this.scale, this.width), inside((y - this.y) / this.scale, this.height)];
  }

  /** Bring a point into sight. @param {number[]} point */
  reveal(point) {
    const [x, y] = this.toFrame(point);
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (x < 0 || y < 0 || x > width || y > height) this.pan(width / 2 - x, height / 2 - y);
  }

  #whole() {
    return Math.min(this.frame.clientWidth / this.width, this.frame.clientHeight / this.height) || 1;
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 : 1;
    const [x, y] = this.place(event);
    this.zoom(Math.exp(-event.deltaY * lines * 0.002), x, y);
  }

  /** Keep what is between two fingers between them. @param {PointerEvent} event */
  #finger(event) {
    if (!this.fingers.has(event.pointerId)) return;
    const [x, y, apart] = this.#between();
    this.fingers.set(event.pointerId, this.place(event));
    if (!this.pinched) return;
    const [toX, toY, farther] = this.#between();
    this.zoom(farther / Math.max(apart, 1), x, y);
    if (!this.fitted) this.pan(toX - x, toY - y);
  }

  /** The middle of two fingers, and how far they are apart. */
  #between() {
    const [[x, y], [otherX, otherY] = [x, y]] = this.fingers.values();
    return [(x + otherX) / 2, (y + otherY) / 2, Math.hypot(x - otherX, y - otherY)];
  }

  #changed() {
    // The middle of the frame stays on the photo, which is never lost from sight.
    const { clientWidth, clientHeight } = this.frame;
    this.x = Math.min(Math.max(this.x, clientWidth / 2 - this.width * this.scale), clientWidth / 2);
    this.y = Math.min(Math.max(this.y, clientHeight / 2 - this.height * this.scale), clientHeight / 2);
    this.dispatchEvent(new Event("change"));
  }
}
