// @ts-check
/** A magnifier over a photo, for what a finger or the pointer hides. */

const SIDE = 132; // CSS px
const TIMES = 3; // as large as the photo is shown

export class Loupe {
  /** @param {HTMLElement} frame @param {import("./viewport.js").Viewport} viewport @param {HTMLImageElement} picture */
  constructor(frame, viewport, picture) {
    this.viewport = viewport;
    this.picture = picture;
    this.canvas = document.createElement("canvas");
    this.canvas.className = "loupe";
    this.canvas.hidden = true;
    this.canvas.setAttribute("aria-hidden", "true");
    this.canvas.width = this.canvas.height = SIDE * Math.min(window.devicePixelRatio, 2);
    frame.append(this.canvas);
  }

  /** Show what is round a place of the photo. @param {number[]} place */
  show(place) {
    const { canvas, viewport, picture } = this;
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const density = picture.naturalWidth / viewport.width; // of the picture, to the photo
    const seen = (SIDE / (viewport.scale * TIMES)) * density;
    const [x, y] = place.map((at) => (at + 0.5) * density - seen / 2);
    context.imageSmoothingEnabled = seen > 20;
    context.fillStyle = "#888";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(picture, x, y, seen, seen, 0, 0, canvas.width, canvas.height);
    const middle = canvas.width / 2;
    for (const [color, width] of /** @type {[string, number][]} */ ([["rgb(0 0 0 / 0.6)", 4], ["#ffd24a", 2]])) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      context.arc(middle, middle, canvas.width / 12, 0, 2 * Math.PI);
      context.stroke();
    }
    // In the corner that the hand is far from.
    const [left, top] = viewport.toFrame(place);
    const { clientWidth, clientHeight } = viewport.frame;
    canvas.classList.toggle("right", left < clientWidth / 2);
    canvas.classList.toggle("low", left < clientWidth / 2 && top < clientHeight / 2 && clientHeight > 2.4 * SIDE);
    canvas.hidden = false;
  }

  hide() {
    this.canvas.hidden = true;
  }
}
