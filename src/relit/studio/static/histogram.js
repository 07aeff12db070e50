// @ts-check
/** How a picture's pixels are spread over the levels, and which of them are at an end. */

const MOST = 400_000; // pixels that are counted: those of a preview of 640 px, in some milliseconds
const FEW = 0.001; // share of the pixels that may be at an end before it is worth a mark
const COLORS = { red: "#e5484d", green: "#30a46c", blue: "#3e63dd", luminance: "#8b8d98" };
const MARKS = { low: [60, 120, 255, 255], high: [255, 40, 40, 255] };

/**
 * @typedef {keyof typeof COLORS} Channel
 * @typedef {Record<Channel, Uint32Array> & {pixels: number, low: number, high: number}} Counts the pixels of each
 *   level, and those of which some channel is at the lowest or the highest
 */

/** The pixels of a picture, every so many where there are a great many. @param {HTMLImageElement} picture */
export function pixelsOf(picture) {
  const { naturalWidth: width, naturalHeight: height } = picture;
  const scale = Math.min(Math.sqrt(MOST / (width * height)), 1);
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height].map((size) => Math.max(Math.round(size * scale), 1));
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  // A mean of several pixels would not be at an end where one of them is.
  pen.imageSmoothingEnabled = false;
  pen.drawImage(picture, 0, 0, canvas.width, canvas.height);
  return pen.getImageData(0, 0, canvas.width, canvas.height);
}

/** @param {Uint8ClampedArray} data RGBA @returns {Counts} */
export function count(data) {
  const [red, green, blue, luminance] = Array.from({ length: 4 }, () => new Uint32Array(256));
  let low = 0;
  let high = 0;
  for (let at = 0; at < data.length; at += 4) {
    const r = data[at];
    const g = data[at + 1];
    const b = data[at + 2];
    red[r] += 1;
    green[g] += 1;
    blue[b] += 1;
    // ITU-R BT.709, in whole numbers so that halves are rounded alike everywhere.
    luminance[((2126 * r + 7152 * g + 722 * b + 5000) / 10000) | 0] += 1;
    if (r === 0 || g === 0 || b === 0) low += 1;
    if (r === 255 || g === 255 || b === 255) high += 1;
  }
  return { red, green, blue, luminance, pixels: data.length / 4, low, high };
}

/** Which ends have more pixels than can be overlooked. @param {Counts} counts */
export function clipped({ pixels, low, high }) {
  return { low: low > FEW * pixels, high: high > FEW * pixels };
}

/** Draw the counts, the luminance behind the channels. @param {HTMLCanvasElement} canvas @param {Counts} counts */
export function drawCounts(canvas, counts) {
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const { width, height } = canvas;
  pen.clearRect(0, 0, width, height);
  const order = /** @type {Channel[]} */ (["luminance", "red", "green", "blue"]);
  // What is clipped, and scattered by JPEG over the levels beside it, has its marks; the curve is for the rest.
  const most = Math.max(...order.map((name) => Math.max(...counts[name].subarray(4, 252))), 1);
  for (const name of order) {
    pen.beginPath();
    pen.moveTo(0, height);
    counts[name].forEach((pixels, level) => {
      // Square roots, or a backdrop of one tone would press the face to the ground.
      pen.lineTo((level / 255) * width, height * (1 - Math.sqrt(Math.min(pixels / most, 1))));
    });
    pen.lineTo(width, height);
    pen.fillStyle = pen.strokeStyle = COLORS[name];
    pen.globalAlpha = name === "luminance" ? 0.45 : 0.2;
    pen.fill();
    pen.globalAlpha = name === "luminance" ? 0 : 0.9;
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

/**
 * Mark the pixels at an end, in a picture of the same size.
 * @param {HTMLCanvasElement} canvas @param {ImageData} picture @param {{low: boolean, high: boolean}} ends
 */
export function markClipped(canvas, { data, width, height }, ends) {
  const marks = new ImageData(width, height);
  for (let at = 0; at < data.length; at += 4) {
    const channels = [data[at], data[at + 1], data[at + 2]];
    const end = ends.high && channels.includes(255) ? "high" : ends.low && channels.includes(0) ? "low" : null;
    if (end) marks.data.set(MARKS[end], at);
  }
  [canvas.width, canvas.height] = [width, height];
  canvas.getContext("2d")?.putImageData(marks, 0, 0);
}
