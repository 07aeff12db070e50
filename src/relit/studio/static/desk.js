// @ts-check
/** The light as a thing to take hold of: a ball that it falls on, and the lamps that make it. */

import { LightBall } from "./ball.js";
import { WHITE, lampsOf, textOf } from "./lamps.js";

/** @typedef {import("./lamps.js").Lamp} Lamp */

const FIRST = "-32,28"; // where a lamp stands that is put beside a photo's light: that of "loop"
const MOST = 6; // lamps that one sets by hand

export class LightDesk extends EventTarget {
  /** @param {HTMLElement} root @param {import("./lamps.js").Known} known */
  constructor(root, known) {
    super();
    this.root = root;
    this.known = known;
    /** @type {Record<string, any>} */
    this.options = {};
    /** @type {Lamp[]} */
    this.lamps = [];
    this.ball = new LightBall(this.#part(".ball"));
    this.ball.addEventListener("input", (event) => this.#moved(/** @type {CustomEvent} */ (event).detail));
    this.ball.addEventListener("change", () => this.#say("rest", null));
    this.ball.addEventListener("choose", () => this.#list());
    this.#part("[data-from=photo]").addEventListener("click", () => this.#say("from", null));
    this.#part("[data-from=lamp]").addEventListener("click", () => this.#say("from", FIRST));
    this.#part("[data-do=add]").addEventListener("click", () => {
      // Opposite the first, and half as strong: a kicker.
      const { azimuth, elevation } = this.lamps[0];
      const across = azimuth > 0 ? azimuth - 150 : azimuth + 150;
      this.#become([...this.lamps, { azimuth: across, elevation, size: 10, power: 0.5, color: WHITE, name: null }]);
      this.#say("rest", null);
    });
  }

  /** @param {Record<string, any>} options @param {boolean} hasReference */
  show(options, hasReference) {
    this.options = options;
    const lit = Boolean(options.light);
    this.lamps = lit ? lampsOf(options.light, this.known) : [];
    this.ball.mode = lit ? "lamps" : "carry";
    this.ball.handles = this.lamps;
    if (!hasReference && !lit) this.ball.lamps = [];
    this.#part("[data-from=photo]").setAttribute("aria-pressed", String(!lit));
    this.#part("[data-from=photo]").disabled = !hasReference;
    this.#part("[data-from=lamp]").setAttribute("aria-pressed", String(lit));
    this.#part(".source").hidden = lit || !hasReference;
    this.#part("[data-do=add]").hidden = !lit || this.lamps.length >= MOST;
    this.#part(".note").textContent = lit
      ? "Drag a lamp on the ball. Then the wheel, or two fingers, make it larger, and its shadows softer."
      : "Drag the ball to carry the photo's light round the face.";
    this.#list();
  }

  /** The photo whose light it is. @param {Blob} picture @param {string} name */
  source(picture, name) {
    const image = this.#part(".source img");
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(picture);
    this.#part(".source figcaption").textContent = `The light of ${name || "the reference"}`;
  }

  /** What the server says of the light in use. @param {[number, number, number, string][]} lamps @param {number} fill */
  light(lamps, fill) {
    this.ball.fill = fill;
    this.ball.lamps = lamps;
  }

  /** @param {any} to */
  #moved(to) {
    if (this.options.light) {
      const { index, azimuth, elevation, size } = to;
      this.#become(this.lamps.map((lamp, k) => (k === index ? { ...lamp, azimuth, elevation, size, name: null } : lamp)));
      return;
    }
    const within = (/** @type {number} */ value, /** @type {number} */ most) =>
      Math.round(Math.min(Math.max(value, -most), most));
    const turn = within((this.options.turn ?? 0) + (to.turn ?? 0), 180);
    const tilt = within((this.options.tilt ?? 0) + (to.tilt ?? 0), 90);
    this.#say("change", { turn, tilt });
  }

  /** @param {Lamp[]} lamps */
  #become(lamps) {
    // At once, without the server: the strongest counts as 1.
    const most = Math.max(...lamps.map(({ power }) => power), 1e-6);
    this.ball.lamps = lamps.map(({ azimuth, elevation, power, color }) => [azimuth, elevation, power / most, color]);
    this.#say("change", { light: textOf(lamps, this.known) });
  }

  /** The lamps, one below the other; made anew only when there are others, so that a hand keeps its slider. */
  #list() {
    const list = this.#part("ol");
    while (list.children.length > this.lamps.length) list.lastElementChild.remove();
    while (list.children.length < this.lamps.length) list.append(this.#row(list.children.length));
    this.lamps.forEach(({ name, azimuth, elevation, size, power, color }, k) => {
      const row = list.children[k];
      row.classList.toggle("chosen", k === this.ball.chosen);
      row.querySelector("legend").textContent = name ? name : `Lamp ${k + 1}: ${Math.round(azimuth)}°, ${Math.round(elevation)}°`;
      const now = { size, power, color };
      for (const input of row.querySelectorAll("input")) {
        if (input !== document.activeElement || input.type !== "color") input.value = String(now[/** @type {keyof typeof now} */ (input.name)]);
      }
      // The strongest counts as 1: one alone has no other power.
      for (const part of row.querySelectorAll(":has(> [name=power]), [data-do=remove]")) part.hidden = this.lamps.length < 2;
    });
  }

  /** @param {number} k */
  #row(k) {
    const row = /** @type {DocumentFragment} */ (this.#part("template").content.cloneNode(true)).firstElementChild;
    for (const input of /** @type {HTMLElement} */ (row).querySelectorAll("input")) {
      input.addEventListener("input", () => {
        const value = input.type === "color" ? input.value : input.valueAsNumber;
        this.#become(this.lamps.map((lamp, at) => (at === k ? { ...lamp, [input.name]: value } : lamp)));
      });
      input.addEventListener("change", () => this.#say("rest", null));
    }
    row?.addEventListener("focusin", () => (this.ball.chosen = k));
    row?.querySelector("[data-do=remove]")?.addEventListener("click", () => {
      this.#become(this.lamps.filter((_, at) => at !== k));
      this.#say("rest", null);
    });
    return /** @type {HTMLElement} */ (row);
  }

  /** @param {string} type @param {unknown} detail */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** @param {string} selector @returns {any} */
  #part(selector) {
    return this.root.querySelector(selector);
  }
}
