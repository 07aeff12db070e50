// @ts-check
/** The histogram under the picture, with a mark at each end that shows on the picture what is clipped there. */

import { clipped, count, drawCounts, markClipped, pixelsOf } from "./histogram.js";

const WORDS = { low: "Shadows", high: "Highlights" };

export class Levels {
  /** @param {(selector: string) => any} part */
  constructor(part) {
    this.canvas = /** @type {HTMLCanvasElement} */ (part(".histogram canvas"));
    /** Lies over the picture. */
    this.marks = document.createElement("canvas");
    this.marks.className = "marks";
    this.marks.setAttribute("aria-hidden", "true");
    this.ends = /** @type {const} */ (["low", "high"]).map((end) => ({ end, button: part(`[data-end=${end}]`), on: false }));
    /** @type {WeakMap<HTMLImageElement, {pixels: ImageData, counts: import("./histogram.js").Counts}>} */
    this.known = new WeakMap();
    /** @type {HTMLImageElement | null} */
    this.picture = null;
    for (const one of this.ends) {
      one.button.addEventListener("click", () => {
        one.on = !one.on;
        this.show(this.picture);
      });
    }
  }

  /** @param {HTMLImageElement | null} picture that has been decoded */
  show(picture) {
    this.picture = picture;
    this.marks.remove();
    const found = picture && this.#measured(picture);
    const over = found ? clipped(found.counts) : { low: false, high: false };
    for (const { end, button, on } of this.ends) {
      const share = found ? (100 * found.counts[end]) / found.counts.pixels : 0;
      button.disabled = !over[end];
      button.setAttribute("aria-pressed", String(on));
      button.setAttribute("aria-label", `${WORDS[end]}: ${share.toFixed(1)} % clipped; show where`);
      button.title = `${share.toFixed(1)} % of the pixels are clipped. Click to see where.`;
    }
    const { canvas } = this;
    const words = found ? `, of mean luminance ${mean(found.counts.luminance).toFixed(0)} of 255` : "";
    canvas.setAttribute("aria-label", `Histogram${words}`);
    if (!picture || !found) return canvas.getContext("2d")?.clearRect(0, 0, canvas.width, canvas.height);
    drawCounts(canvas, found.counts);
    const [low, high] = this.ends.map(({ end, on }) => on && over[end]);
    if (!low && !high) return;
    markClipped(this.marks, found.pixels, { low, high });
    this.marks.style.cssText = picture.style.cssText;
    picture.after(this.marks);
  }

  /** @param {HTMLImageElement} picture */
  #measured(picture) {
    let found = this.known.get(picture);
    if (!found) {
      const pixels = pixelsOf(picture);
      found = { pixels, counts: count(pixels.data) };
      this.known.set(picture, found);
    }
    return found;
  }
}

/** @param {Uint32Array} counts */
function mean(counts) {
  const [sum, pixels] = counts.reduce(([sum, all], some, level) => [sum + some * level, all + some], [0, 0]);
  return sum / Math.max(pixels, 1);
}
