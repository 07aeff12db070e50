// @ts-check
/** Where the pictures of the preview are shown: tabs, and in each what its views call for. */

import { Viewer } from "./viewer.js";

/** Tab → the views that it asks for, as far as the method has them. */
const TABS = {
  result: ["result"],
  warped: ["warped"],
  layers: ["target_light", "new_light", "person"],
  split: ["target_u", "target_v", "reference_u", "reference_v"],
  mask: ["mask", "known"],
  difference: ["difference"],
};

const CAPTIONS = {
  target_light: "Light of the target",
  new_light: "The new light",
  person: "The person",
  target_u: "u of the target: its light",
  target_v: "v of the target: the person",
  reference_u: "u of the reference: the light",
  reference_v: "v of the reference",
  mask: "Where the change goes",
  known: "Where it is known",
};

const [LEAST, MOST] = [64, 2048]; // px that the server makes a preview of

/** @typedef {keyof typeof TABS} Tab */

export class Stage extends EventTarget {
  /** @param {HTMLElement} root */
  constructor(root) {
    super();
    this.root = root;
    /** @type {Tab} */
    this.tab = "result";
    /** @type {string[]} */
    this.views = ["result"];
    this.close = true;
    this.zoom = 1;
    this.longest = 1; // px of the photo
    /** @type {number[]} left, top, right and bottom of the face, in shares of the photo */
    this.face = [0, 0, 1, 1];
    /** @type {Map<HTMLImageElement, string>} */
    this.shown = new Map();
    this.tabs = /** @type {HTMLElement[]} */ ([...root.querySelectorAll("[role=tab]")]);
    this.viewer = new Viewer(this.#part("#viewer"));
    let { side } = this.viewer;
    this.viewer.addEventListener("change", () => {
      if (side === this.viewer.side) return;
      side = this.viewer.side;
      this.dispatchEvent(new Event("open"));
    });
    const opacity = /** @type {HTMLInputElement} */ (this.#part("#onion"));
    const onion = /** @type {HTMLElement} */ (this.#part(".onion .over"));
    const fade = () => (onion.style.opacity = String(opacity.valueAsNumber / 100));
    opacity.addEventListener("input", fade);
    fade();
    for (const tab of this.tabs) tab.addEventListener("click", () => this.open(/** @type {Tab} */ (tab.dataset.tab)));
    this.#part("[role=tablist]").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.#key(event));
    this.#part("#close").addEventListener("click", () => {
      this.close = !this.close;
      this.frame();
      this.dispatchEvent(new Event("open"));
    });
    this.open("result");
  }

  /** The views that are wanted now. */
  get wanted() {
    return TABS[this.tab].filter((view) => this.views.includes(view) || TABS[this.tab].length === 1);
  }

  /** How many px of a picture can be seen. */
  get side() {
    if (this.tab === "result") return this.viewer.side;
    const seen = Math.max(this.root.clientWidth, 320) * Math.min(window.devicePixelRatio, 2) * this.zoom;
    return Math.min(Math.max(Math.ceil(seen / 160) * 160, 480), 1440);
  }

  /** As many px of the photo's reduction by a whole factor that is no smaller than what can be seen. */
  get fine() {
    const factor = Math.max(Math.floor(this.longest / this.side), Math.ceil(this.longest / MOST), 1);
    return Math.max(Math.ceil(this.longest / factor), LEAST);
  }

  /** @param {Tab} name */
  open(name) {
    this.tab = name;
    this.root.dataset.tab = name;
    for (const tab of this.tabs) {
      const chosen = tab.dataset.tab === name;
      tab.setAttribute("aria-selected", String(chosen));
      tab.tabIndex = chosen ? 0 : -1;
      this.#part(`#panel-${tab.dataset.tab}`).hidden = !chosen;
    }
    this.#part("#close").hidden = name === "result"; // which zooms by itself
    this.dispatchEvent(new Event("open"));
  }

  /** @param {Blob} target the photo before @param {import("./api.js").Photo} photo */
  before(target, { width, height, landmarks }) {
    this.root.style.setProperty("--ratio", String(width / height));
    this.longest = Math.max(width, height);
    this.viewer.photo(target, { width, height });
    const points = /** @type {number[][]} */ (landmarks?.points.filter(Boolean) ?? [[0, 0], [width, height]]);
    const shares = [0, 1].map((axis) => points.map((at) => at[axis] / (axis ? height : width)));
    this.face = [Math.min, Math.max].flatMap((end) => shares.map((axis) => end(...axis)));
    this.frame();
    for (const image of this.root.querySelectorAll(".before")) this.#show(/** @type {HTMLImageElement} */ (image), target);
  }

  /** @param {import("./preview.js").Picture} picture */
  show({ view, blob, window, views }) {
    this.root.classList.add("filled");
    this.views = views;
    for (const tab of this.tabs) {
      tab.hidden = !TABS[/** @type {Tab} */ (tab.dataset.tab)].some((view) => this.views.includes(view));
    }
    if (view === "result") return this.viewer.show(blob);
    const image = /** @type {HTMLImageElement} */ (this.#part(`[data-view="${view}"]`) ?? this.#figure(view));
    this.#show(image, blob);
    if (image.classList.contains("over")) {
      const [left, top, width, height] = window.map((share) => `${share * 100}%`);
      Object.assign(image.style, { left, top, width, height });
    }
    for (const figure of this.root.querySelectorAll("figure")) {
      const view = figure.querySelector("img")?.dataset.view;
      figure.hidden = !view || !this.views.includes(view);
    }
  }

  /** Show the face, with as much again around it, or all of the photo. */
  frame() {
    const [left, top, right, bottom] = this.face;
    const share = Math.min(2 * Math.max(right - left, bottom - top), 1);
    this.zoom = this.close ? 1 / share : 1;
    /** @type {(middle: number) => number} */
    const start = (middle) => (this.close ? Math.min(Math.max(middle - share / 2, 0), 1 - share) : 0);
    const style = this.root.style;
    style.setProperty("--zoom", String(this.zoom));
    style.setProperty("--left", String(start((left + right) / 2) * this.zoom));
    style.setProperty("--top", String(start((top + bottom) / 2) * this.zoom));
    this.#part("#close").setAttribute("aria-pressed", String(this.close));
  }

  clear() {
    this.root.classList.remove("filled");
    this.viewer.clear();
  }

  /** @param {string} view */
  #figure(view) {
    const tab = Object.entries(TABS).find(([, views]) => views.includes(view))?.[0];
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const text = CAPTIONS[/** @type {keyof typeof CAPTIONS} */ (view)] ?? view;
    const image = new Image();
    caption.textContent = image.alt = text;
    image.dataset.view = view;
    figure.append(image, caption);
    this.#part(`#panel-${tab} .figures`).append(figure);
    return image;
  }

  /** @param {HTMLImageElement} image @param {Blob} blob */
  #show(image, blob) {
    const old = this.shown.get(image);
    this.shown.set(image, (image.src = URL.createObjectURL(blob)));
    if (old) URL.revokeObjectURL(old);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const there = this.tabs.filter((tab) => !tab.hidden);
    const at = there.findIndex((tab) => tab.dataset.tab === this.tab);
    /** @type {Record<string, number>} */
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1 + there.length, Home: 0, End: there.length - 1 };
    if (!(event.key in to)) return;
    event.preventDefault();
    const next = there[to[event.key] % there.length];
    this.open(/** @type {Tab} */ (next.dataset.tab));
    next.focus();
  }

  /** @param {string} selector @returns {any} */
  #part(selector) {
    return this.root.querySelector(selector);
  }
}
