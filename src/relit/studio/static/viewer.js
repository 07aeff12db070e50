// @ts-check
/** The result, large: zoomed, moved, compared with the photo before, measured, and taken out of the page. */

import { comparison } from "./compare.js";
import { Decoder } from "./decoder.js";
import { holding } from "./hold.js";
import { Levels } from "./levels.js";
import { asPng, carry, copied } from "./outgoing.js";
import { Pane } from "./pane.js";
import { build } from "./viewer_parts.js";

/** @typedef {import("./viewer_parts.js").Mode} Mode */

const SIDES = [480, 2048]; // px that a preview has at least, and those that the server makes at most
const STEP = 160; // px: not every turn of the wheel is worth a new preview

export class Viewer extends EventTarget {
  /**
   * Events: "change" when what is seen has changed, "mode" when the way to compare has.
   * @param {HTMLElement} root an empty element
   */
  constructor(root) {
    super();
    this.root = root;
    const part = build(root);
    this.panes = /** @type {HTMLElement} */ (part(".panes"));
    this.layers = { before: part(".main .before"), after: part(".main .after"), twin: part(".twin .layer") };
    const bar = /** @type {HTMLElement} */ (part("[role=slider]"));
    const takes = (/** @type {PointerEvent} */ event) => {
      const grips = this.main.viewport.fitted || bar.contains(/** @type {Node} */ (event.target));
      return event.isPrimary && grips && root.dataset.mode === "slider";
    };
    // Before the pane, which moves the picture where the bar does not take the pointer.
    this.placeBar = comparison(part(".main"), takes, () => this.main?.span ?? [0, 1]);
    this.main = new Pane(part(".main"), [this.layers.before, this.layers.after]);
    this.twin = new Pane(part(".twin"), [this.layers.twin]);
    this.levels = new Levels(part);
    /** @type {{before: HTMLImageElement | null, after: HTMLImageElement | null, twin: HTMLImageElement | null}} */
    this.pictures = { before: null, after: null, twin: null };
    this.decoders = { before: new Decoder(), after: new Decoder() };
    this.held = false;
    /** What is dragged out of the page; by default the preview. @type {() => import("./outgoing.js").Outgoing} */
    this.file = () => ({ url: this.pictures.after?.src ?? "", name: "relit.jpg" });
    /** @type {Mode} */
    this.way = "slider";

    this.zoomed = /** @type {HTMLElement} */ (part(".zoom"));
    this.main.viewport.addEventListener("change", () => this.#moved(this.main, this.twin));
    this.twin.viewport.addEventListener("change", () => this.mode === "side" && this.#moved(this.twin, this.main));
    new ResizeObserver(() => this.#arrange()).observe(this.panes);
    const { viewport } = this.main;
    const acts = { in: () => viewport.zoom(1.25), out: () => viewport.zoom(0.8), fit: () => this.fit(), actual: () => this.actual() };
    for (const [name, act] of Object.entries(acts)) part(`[data-do=${name}]`).addEventListener("click", act);
    this.modes = /** @type {HTMLElement[]} */ ([...root.querySelectorAll("button[data-mode]")]);
    for (const button of this.modes) {
      button.addEventListener("click", () => (this.mode = /** @type {Mode} */ (button.dataset.mode)));
    }
    holding(part("[data-do=hold]"), ["b", "\\"], (held) => this.hold(held));
    root.addEventListener("dragstart", (event) => this.#dragged(event));
    this.mode = "slider";
  }

  /** How result and photo are compared. */
  get mode() {
    return this.way;
  }
  set mode(mode) {
    this.way = mode;
    for (const button of this.modes) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
    this.#arrange();
    this.dispatchEvent(new CustomEvent("mode", { detail: { mode } }));
    this.dispatchEvent(new Event("change"));
  }

  /** How many px the longer side of a preview needs for what is seen to be sharp. */
  get side() {
    const { width, height, scale } = this.main.viewport;
    const seen = Math.max(width, height) * Math.min(scale * window.devicePixelRatio, 1);
    return Math.min(Math.max(Math.ceil(seen / STEP) * STEP, SIDES[0]), SIDES[1]);
  }

  /** The picture that is seen, or that lies over the other. */
  get shown() {
    return (!this.held && this.pictures.after) || this.pictures.before;
  }

  /**
   * Show the photo before.
   * @param {Blob} blob which may be smaller than the photo @param {{width: number, height: number}} photo its size in px
   */
  async photo(blob, { width, height }) {
    const [before, twin] = await this.decoders.before.decode(blob, 2);
    if (!before) return;
    const { viewport } = this.main;
    const same = viewport.width === width && viewport.height === height;
    Object.assign(viewport, { width, height });
    this.root.style.setProperty("--ratio", String(width / height));
    before.alt = twin.alt = "Before";
    this.#put("before", before);
    this.#put("twin", twin);
    this.#arrange();
    if (!same) this.fit();
  }

  /** Show the result, where and as large as the photo is seen. @param {Blob} blob */
  async show(blob) {
    const [after] = await this.decoders.after.decode(blob);
    if (!after) return;
    after.alt = "After";
    this.#put("after", after);
    this.#arrange();
  }

  /** Show no result until there is another. */
  clear() {
    this.decoders.after.cancel();
    this.#put("after", null);
    this.#arrange();
  }

  /** Show all of the photo. */
  fit() {
    this.main.viewport.fit();
  }

  /** Show a pixel of the screen (not of CSS) for each of the photo. */
  actual() {
    this.main.actual();
  }

  /** Show the photo before in place of the result, or no longer. @param {boolean} held */
  hold(held) {
    if (held === this.held) return;
    this.held = held;
    this.#arrange();
  }

  /** Copy the picture that is seen as PNG, and return what went wrong, if anything did. */
  async copy() {
    return this.shown ? copied(asPng(this.shown)) : "There is no picture yet.";
  }

  /** @param {"before" | "after" | "twin"} name @param {HTMLImageElement | null} picture */
  #put(name, picture) {
    const old = this.pictures[name];
    this.pictures[name] = picture;
    this.layers[name].replaceChildren(...(picture ? [picture] : []));
    if (old) URL.revokeObjectURL(old.src);
  }

  /** Show what there is to show, in the way that is chosen. */
  #arrange() {
    const { root, panes, pictures, main, twin } = this;
    const { width, height } = main.viewport;
    const mode = pictures.after ? this.way : "after";
    root.dataset.mode = mode;
    root.classList.toggle("filled", Boolean(pictures.after));
    root.classList.toggle("held", this.held);
    twin.root.hidden = mode !== "side";
    const beside = Math.min(panes.clientWidth / 2 / width, panes.clientHeight / height);
    const below = Math.min(panes.clientWidth / width, panes.clientHeight / 2 / height);
    panes.classList.toggle("stacked", mode === "side" && below > beside);
    twin.follow(main);
    main.place();
    this.placeBar();
    this.#offer();
    this.levels.show(this.shown);
  }

  /** A picture that cannot be moved in its frame can be dragged out of it. */
  #offer() {
    const free = this.main.viewport.fitted && this.way !== "slider";
    for (const picture of Object.values(this.pictures)) if (picture) picture.draggable = false;
    if (this.pictures.after) this.pictures.after.draggable = free;
  }

  /** @param {Pane} by what the hand moved @param {Pane} other */
  #moved(by, other) {
    other.follow(by);
    const { scale } = this.main.viewport;
    this.placeBar();
    this.zoomed.textContent = `${Math.round(100 * scale * window.devicePixelRatio)} %`;
    this.#offer();
    this.dispatchEvent(new Event("change"));
  }

  /** @param {DragEvent} event */
  #dragged(event) {
    if (this.pictures.after) carry(event, this.file());
    else event.preventDefault();
  }
}
