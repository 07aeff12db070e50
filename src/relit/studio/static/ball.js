// @ts-check
/** A ball in the light, whose lamps can be taken hold of. */

import { BallHand } from "./ball_hand.js";
import { Handles } from "./ball_handles.js";
import { drawBall } from "./ball_picture.js";
import { REACH, angles, direction, fromPlace, place, spoken } from "./sphere.js";

/**
 * @typedef {import("./sphere.js").Lamp} Lamp
 * @typedef {{azimuth: number, elevation: number, color: string, size: number}} Handle a lamp to take hold of; its
 *   size in degrees, from its middle to its rim
 * @typedef {{lamps: Lamp[], fill: number, handles: Handle[], chosen: number, mode: "lamps" | "carry"}} Shown
 */

const SIZES = [1, 60]; // degrees: what the option `light` takes
const MARGIN = 10; // CSS px around the map, for half a handle

export class LightBall extends EventTarget {
  /**
   * Events: "input" while a lamp is moved and "change" when it is let go, each with {index, azimuth, elevation, size},
   * or in mode "carry" with {turn, tilt}, the degrees since the event before; "choose" with {index}.
   * @param {HTMLElement} root an empty element, to be a square
   */
  constructor(root) {
    super();
    this.root = root;
    /** @type {Shown} */
    this.now = { lamps: [], fill: 0, handles: [], chosen: 0, mode: "lamps" };
    this.planned = false;
    root.classList.add("ball");
    root.setAttribute("role", "application");
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("aria-hidden", "true");
    root.replaceChildren(this.canvas);
    this.dots = new Handles(root, (index) => this.#choose(index));
    this.moved = false;
    const hand = new BallHand(root);
    hand.addEventListener("take", (event) => this.#take(/** @type {CustomEvent} */ (event).detail));
    hand.addEventListener("drag", (event) => this.#drag(/** @type {CustomEvent} */ (event).detail));
    hand.addEventListener("nudge", (event) => this.#nudge(/** @type {CustomEvent} */ (event).detail));
    hand.addEventListener("resize", (event) => this.#resize(/** @type {CustomEvent} */ (event).detail));
    hand.addEventListener("step", (event) => this.dots.step(this.chosen, /** @type {CustomEvent} */ (event).detail.by));
    hand.addEventListener("end", () => this.moved && this.#say("change", { turn: 0, tilt: 0 }));
    new ResizeObserver(() => this.#changed({})).observe(root);
    this.#changed({});
  }

  /** The light that is shown. */
  get lamps() {
    return this.now.lamps;
  }
  set lamps(lamps) {
    this.#changed({ lamps });
  }

  /** The share of the light that comes from everywhere. */
  get fill() {
    return this.now.fill;
  }
  set fill(fill) {
    this.#changed({ fill });
  }

  /** The lamps that can be moved. */
  get handles() {
    return this.now.handles;
  }
  set handles(handles) {
    this.#changed({ handles: handles.map((handle) => ({ ...handle })) });
  }

  /** The index of the lamp that keys and wheel change. */
  get chosen() {
    return this.now.chosen;
  }
  set chosen(chosen) {
    this.#changed({ chosen });
  }

  /** Whether lamps are moved one by one, or the whole light is carried round the head. */
  get mode() {
    return this.now.mode;
  }
  set mode(mode) {
    this.#changed({ mode });
  }

  /** CSS px of the ball. */
  get radius() {
    return Math.max(this.root.clientWidth / 2 - MARGIN, 1) / REACH;
  }

  /** @param {Partial<Shown>} given */
  #changed(given) {
    Object.assign(this.now, given);
    const { now, root } = this;
    now.chosen = Math.min(Math.max(now.chosen, 0), Math.max(now.handles.length - 1, 0));
    this.dots.show(now.mode === "lamps" ? now.handles : [], now.chosen, this.radius);
    const light = now.lamps.map(([azimuth, elevation]) => spoken(azimuth, elevation)).slice(0, 3).join("; ");
    const what = now.mode === "carry" ? "The light, to carry round the head" : "Lamps, to move round the head";
    root.setAttribute("aria-label", `${what}: ${light || "none"}`);
    root.dataset.mode = now.mode;
    if (now.mode === "carry") root.tabIndex = 0;
    else root.removeAttribute("tabindex");
    this.#later();
  }

  /** @param {number} index */
  #choose(index) {
    if (index === this.now.chosen) return;
    this.#changed({ chosen: index });
    this.dispatchEvent(new CustomEvent("choose", { detail: { index } }));
  }

  /** A hand comes down, on a lamp or beside them. @param {{index: number | null}} grip */
  #take({ index }) {
    if (index !== null) this.#choose(index);
    (this.dots.buttons[this.now.chosen] ?? this.root).focus({ preventScroll: true });
    const held = this.now.handles[this.now.chosen];
    this.origin = held && place(direction(held.azimuth, held.elevation));
    this.carried = { turn: 0, tilt: 0 };
  }

  /** The hand is so many CSS px from where it came down. @param {{x: number, y: number}} way */
  #drag({ x, y }) {
    const { radius, origin, carried } = this;
    if (this.now.mode === "carry" && carried) {
      // From the middle to the rim is a right angle.
      const to = { turn: Math.round((90 * x) / radius), tilt: Math.round((-90 * y) / radius) };
      const by = { turn: to.turn - carried.turn, tilt: to.tilt - carried.tilt };
      this.carried = to;
      if (by.turn || by.tilt) this.#say("input", by);
    } else if (origin) {
      const [azimuth, elevation] = angles(fromPlace(origin[0] + x / radius, origin[1] + y / radius));
      this.#move({ azimuth, elevation });
    }
  }

  /** @param {{right: number, up: number}} degrees */
  #nudge({ right, up }) {
    const held = this.now.handles[this.now.chosen];
    if (this.now.mode === "carry") this.#say("input", { turn: right, tilt: up });
    else if (held) {
      const azimuth = ((held.azimuth + right + 540) % 360) - 180;
      this.#move({ azimuth, elevation: Math.min(Math.max(held.elevation + up, -90), 90) });
    }
  }

  /** @param {{by: number}} factor */
  #resize({ by }) {
    const held = this.now.handles[this.now.chosen];
    if (held) this.#move({ size: Math.min(Math.max(held.size * by, SIZES[0]), SIZES[1]) });
  }

  /** @param {Partial<Handle>} to */
  #move(to) {
    const { handles, chosen, mode } = this.now;
    if (mode === "carry" || !handles[chosen]) return;
    const before = JSON.stringify(this.#news);
    Object.assign(handles[chosen], to);
    this.#changed({});
    if (JSON.stringify(this.#news) !== before) this.#say("input");
  }

  /** The chosen lamp in whole degrees, as events tell it. */
  get #news() {
    const { handles, chosen: index } = this.now;
    if (!handles[index]) return null;
    const { azimuth, elevation, size } = handles[index];
    return { index, azimuth: Math.round(azimuth), elevation: Math.round(elevation), size: Math.round(size) };
  }

  /** @param {"input" | "change"} type @param {{turn: number, tilt: number}} [carried] */
  #say(type, carried) {
    this.moved = type === "input";
    const detail = this.now.mode === "carry" ? carried : this.#news;
    if (detail) this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** Draw before the next frame, once for all that changes until then. */
  #later() {
    if (this.planned) return;
    this.planned = true;
    requestAnimationFrame(() => {
      this.planned = false;
      drawBall(this.canvas, this.root.clientWidth, this.radius, this.now);
    });
  }
}
