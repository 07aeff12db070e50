// @ts-check
/** What pointer, fingers, wheel and keyboard ask of the light ball. */

const STILL = 300; // ms without a turn of the wheel after which it is let go

export class BallHand extends EventTarget {
  /**
   * Events: "take" with {index} of the lamp under the pointer, "drag" with {x, y} in CSS px since then, "nudge" with
   * {right, up} in degrees, "resize" and "step" with {by}, and "end" when it is let go.
   * @param {HTMLElement} root
   */
  constructor(root) {
    super();
    this.root = root;
    /** @type {Map<number, {from: number[], at: number[]}>} pointers that are down */
    this.fingers = new Map();
    this.pinching = false;
    root.addEventListener("pointerdown", (event) => this.#press(event));
    root.addEventListener("pointermove", (event) => this.#move(event));
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) {
      root.addEventListener(type, (event) => this.#lift(event));
    }
    root.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    root.addEventListener("keydown", (event) => this.#key(event));
  }

  /** @param {string} type @param {object} [detail] */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (event.button !== 0) return;
    // The focus goes where the ball says, not to what is under the pointer.
    event.preventDefault();
    this.root.setPointerCapture(event.pointerId);
    const place = [event.clientX, event.clientY];
    this.fingers.set(event.pointerId, { from: place, at: place });
    this.pinching = this.fingers.size > 1;
    if (this.pinching) return;
    const button = /** @type {Element} */ (event.target).closest("button");
    this.#say("take", { index: button ? Number(button.dataset.index) : null });
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const finger = this.fingers.get(event.pointerId);
    if (!finger) return;
    const apart = this.#apart();
    finger.at = [event.clientX, event.clientY];
    if (this.fingers.size > 1) this.#say("resize", { by: this.#apart() / Math.max(apart, 1) });
    else if (!this.pinching) this.#say("drag", { x: finger.at[0] - finger.from[0], y: finger.at[1] - finger.from[1] });
  }

  /** @param {PointerEvent} event */
  #lift(event) {
    if (this.fingers.delete(event.pointerId) && !this.fingers.size) this.#say("end");
  }

  /** How far two fingers are apart. */
  #apart() {
    const [one, other = one] = [...this.fingers.values()].map(({ at }) => at);
    return Math.hypot(one[0] - other[0], one[1] - other[1]);
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    // Who only scrolls past does not change the light.
    if (!this.root.contains(document.activeElement)) return;
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 : 1;
    this.#say("resize", { by: Math.exp(-event.deltaY * lines * 0.002) });
    clearTimeout(this.turning);
    this.turning = setTimeout(() => this.#say("end"), STILL);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const far = event.shiftKey ? 10 : 2;
    /** @type {Record<string, [type: string, detail: object]>} */
    const acts = {
      ArrowLeft: ["nudge", { right: -far, up: 0 }],
      ArrowRight: ["nudge", { right: far, up: 0 }],
      ArrowUp: ["nudge", { right: 0, up: far }],
      ArrowDown: ["nudge", { right: 0, up: -far }],
      PageUp: ["step", { by: -1 }],
      PageDown: ["step", { by: 1 }],
      "+": ["resize", { by: 1.15 }],
      "=": ["resize", { by: 1.15 }],
      "-": ["resize", { by: 1 / 1.15 }],
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    this.#say(...act);
    if (act[0] !== "step") this.#say("end");
  }
}
