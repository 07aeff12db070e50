// @ts-check
/** Landmarks drawn over a photo, and what pointer and keyboard do to them. */

/** @typedef {import("./api.js").Marks} Marks */

import { Loupe } from "./loupe.js";

const SVG = "http://www.w3.org/2000/svg";
const REACH = 14; // CSS px from a point within which the pointer has it
const SLIP = 5; // CSS px that a finger wanders when it only taps
const LAYERS = ["rest", "halo", "dots", "alone", "hovered", "chosen", "scale"];

export class PointEditor extends EventTarget {
  /** @param {HTMLElement} frame @param {import("./viewport.js").Viewport} viewport */
  constructor(frame, viewport) {
    super();
    this.frame = frame;
    this.viewport = viewport;
    this.adding = false;
    this.spaced = false;
    this.release = () => {};
    /** @type {Marks | null} */
    this.marks = null;
    /** @type {Set<number>} rows that can be had */
    this.live = new Set();
    /** @type {Set<number>} rows without a partner */
    this.alone = new Set();
    /** @type {number | null} */
    this.hovered = null;
    /** @type {number | null} */
    this.chosen = null;
    this.finest = 0;
    this.picture = /** @type {HTMLImageElement} */ (frame.querySelector("img"));
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("aria-hidden", "true");
    this.layers = Object.fromEntries(
      LAYERS.map((name) => {
        const path = document.createElementNS(SVG, "path");
        path.setAttribute("class", name);
        svg.append(path);
        return [name, path];
      }),
    );
    this.label = document.createElementNS(SVG, "text");
    this.sign = document.createElementNS(SVG, "text");
    svg.append(this.label, this.sign);
    frame.append(svg);
    this.loupe = new Loupe(frame, viewport, this.picture);
    viewport.addEventListener("change", () => this.draw());
    frame.addEventListener("pointerdown", (event) => this.#press(event));
    frame.addEventListener("pointermove", (event) => this.#hover(event));
    frame.addEventListener("pointerleave", () => this.#say("hover", { row: null }));
    frame.addEventListener("keydown", (event) => this.#key(event));
    frame.addEventListener("keyup", (event) => (this.spaced &&= event.key !== " "));
    frame.addEventListener("blur", () => (this.spaced = false));
    // A finger on a point drags it, and two zoom; elsewhere, while all is in sight, one scrolls the page.
    const held = (/** @type {TouchEvent} */ event) => {
      const [x, y] = viewport.place(event.touches[0]);
      if (event.touches.length > 1 || this.at(x, y) !== null) event.preventDefault();
    };
    frame.addEventListener("touchstart", held, { passive: false });
  }

  draw() {
    const { viewport, marks } = this;
    this.picture.style.width = `${viewport.width}px`;
    this.picture.style.height = `${viewport.height}px`;
    this.picture.style.transform = `translate(${viewport.x}px, ${viewport.y}px) scale(${viewport.scale})`;
    this.picture.style.imageRendering = viewport.scale > 6 ? "pixelated" : "auto";
    this.frame.classList.toggle("zoomed", !viewport.fitted);
    /** @type {Record<string, string>} */
    const paths = Object.fromEntries(LAYERS.map((name) => [name, ""]));
    this.label.textContent = "";
    marks?.points.forEach((point, row) => {
      if (!point) return;
      const [x, y] = viewport.toFrame(point);
      const layer = this.alone.has(row) ? "alone" : this.live.has(row) ? "dots" : "rest";
      paths[layer] += `M${x.toFixed(1)} ${y.toFixed(1)}h0`;
    });
    paths.halo = paths.dots + paths.alone;
    for (const name of /** @type {const} */ (["hovered", "chosen"])) {
      const row = this[name];
      const point = row === null ? null : marks?.points[row];
      if (!point) continue;
      const [x, y] = viewport.toFrame(point);
      paths[name] = circle(x, y, name === "chosen" ? 8 : 6);
      this.label.setAttribute("x", String(x + 11));
      this.label.setAttribute("y", String(y + 4));
      this.label.textContent = String(row);
    }
    const middle = centre(marks);
    if (middle && this.finest) {
      const [x, y] = viewport.toFrame(middle);
      const radius = (this.finest / 2) * viewport.scale;
      // A pointer to it, for it may be as small as a freckle.
      paths.scale = `${circle(x, y, radius)}M${x + radius + 3} ${y}h22`;
      this.sign.setAttribute("x", String(x + radius + 29));
      this.sign.setAttribute("y", String(y + 4));
    }
    this.sign.textContent = middle && this.finest ? "λ" : "";
    for (const name of LAYERS) this.layers[name].setAttribute("d", paths[name]);
  }

  /** The row under a place of the frame. @param {number} x @param {number} y */
  at(x, y) {
    let nearest = null;
    let least = REACH ** 2;
    this.marks?.points.forEach((point, row) => {
      if (!point || !this.live.has(row)) return;
      const [px, py] = this.viewport.toFrame(point);
      const away = (px - x) ** 2 + (py - y) ** 2;
      if (away < least) [nearest, least] = [row, away];
    });
    return nearest;
  }

  /** @param {string} type @param {object} detail */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** @param {PointerEvent} event */
  #hover(event) {
    if (event.buttons) return;
    const [x, y] = this.viewport.place(event);
    const row = this.at(x, y);
    this.frame.classList.toggle("over-point", row !== null);
    if (row !== this.hovered) this.#say("hover", { row });
  }

  /** @param {PointerEvent} event */
  #press(event) {
    // A second finger ends what the first began.
    if (this.viewport.pinched) return this.release();
    const panning = event.button === 1 || this.spaced;
    if (this.picture.hidden || (event.button !== 0 && !panning)) return;
    const start = this.viewport.place(event);
    const row = panning ? null : this.at(start[0], start[1]);
    if (row !== null) this.#say("choose", { row });
    this.frame.setPointerCapture(event.pointerId);
    const tag = `drag ${event.timeStamp}`;
    const slip = row !== null && event.pointerType === "mouse" ? 0 : SLIP;
    const point = row === null ? null : this.marks?.points[row];
    const [heldX, heldY] = point ? this.viewport.toFrame(point) : start;
    let [x, y] = start;
    let still = true;
    const move = (/** @type {PointerEvent} */ moving) => {
      const [toX, toY] = this.viewport.place(moving);
      if (still && Math.hypot(toX - x, toY - y) <= slip) return;
      // A finger that has slipped off its point takes it along from there, without a jump.
      if (still && slip && row !== null) [x, y] = [toX, toY];
      still = false;
      if (row === null) {
        this.viewport.pan(toX - x, toY - y);
        [x, y] = [toX, toY];
      } else {
        const place = this.viewport.toPhoto(heldX + toX - x, heldY + toY - y);
        this.loupe.show(place);
        this.#say("move", { row, place, tag });
      }
    };
    const end = (/** @type {PointerEvent} */ { type }) => {
      this.release();
      this.loupe.hide();
      const tapped = type === "pointerup" && still && row === null && !panning;
      if (tapped && this.adding) this.#say("add", { place: this.viewport.toPhoto(start[0], start[1]) });
    };
    this.release();
    const over = new AbortController();
    this.release = () => over.abort();
    const mine = (/** @type {(event: PointerEvent) => void} */ act) => (/** @type {PointerEvent} */ other) =>
      other.pointerId === event.pointerId && act(other);
    this.frame.addEventListener("pointermove", mine(move), over);
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) {
      this.frame.addEventListener(type, mine(end), over);
    }
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const way = arrows[/** @type {keyof typeof arrows} */ (event.key)];
    const point = this.chosen === null ? null : this.marks?.points[this.chosen];
    if (way && point) {
      const far = event.shiftKey ? 10 : 1;
      const place = [0, 1].map((axis) => point[axis] + way[axis] * far);
      this.#say("move", { row: this.chosen, place, tag: `nudge ${this.chosen}`, spoken: true });
    } else if (way) this.viewport.pan(-40 * way[0], -40 * way[1]);
    else if (event.key === "PageDown" || event.key === "PageUp") {
      this.#say("step", { by: event.key === "PageDown" ? 1 : -1 });
    } else if (event.key === "Delete" || event.key === "Backspace") this.#say("remove", {});
    else if (event.key === "Escape") this.#say("choose", { row: null });
    else if (event.key === "+" || event.key === "=") this.viewport.zoom(1.25);
    else if (event.key === "-") this.viewport.zoom(0.8);
    else if (event.key === "0") this.viewport.fit();
    else if (event.key === " ") this.spaced = true;
    else if (event.key === "Enter" && this.adding) {
      const { clientWidth, clientHeight } = this.frame;
      this.#say("add", { place: this.viewport.toPhoto(clientWidth / 2, clientHeight / 2) });
    } else return;
    event.preventDefault();
  }
}

/** @param {number} x @param {number} y @param {number} radius */
function circle(x, y, radius) {
  return `M${x - radius} ${y}a${radius} ${radius} 0 1 0 ${2 * radius} 0a${radius} ${radius} 0 1 0 ${-2 * radius} 0`;
}

/** @param {Marks | null} marks */
function centre(marks) {
  const points = /** @type {number[][]} */ (marks?.points.filter(Boolean) ?? []);
  if (points.length < 3) return null;
  return [0, 1].map((axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length);
}
