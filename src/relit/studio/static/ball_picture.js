// @ts-check
/** The picture of the light ball: the ball, the ring of what is behind it, and how large its lamps are. */

import { REACH, direction, place, shade } from "./sphere.js";

const DOT = 3; // CSS px of the radius of the strongest lamp that was found

/**
 * @param {HTMLCanvasElement} canvas @param {number} width CSS px of the canvas @param {number} radius CSS px of the ball
 * @param {import("./ball.js").Shown} shown
 */
export function drawBall(canvas, width, radius, { lamps, fill, handles, chosen, mode }) {
  const density = window.devicePixelRatio;
  const side = Math.round(width * density);
  if (!side) return;
  if (canvas.width !== side) canvas.width = canvas.height = side;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.putImageData(new ImageData(shade(side, radius * density, lamps, fill), side), 0, 0);

  const style = getComputedStyle(canvas);
  const circle = (/** @type {number[]} */ [x, y], /** @type {number} */ size) => {
    pen.beginPath();
    pen.arc(x * radius, y * radius, size, 0, 2 * Math.PI);
  };
  pen.setTransform(density, 0, 0, density, side / 2, side / 2);
  pen.lineWidth = 1;
  pen.strokeStyle = style.getPropertyValue("--edge") || "gray";
  circle([0, 0], radius);
  pen.stroke();
  pen.setLineDash([2, 4]);
  circle([0, 0], REACH * radius);
  pen.stroke();
  pen.setLineDash([]);

  if (mode === "carry") {
    for (const [azimuth, elevation, power, color] of lamps) {
      circle(place(direction(azimuth, elevation)), DOT * Math.sqrt(power) + 1);
      pen.fillStyle = color;
      pen.fill();
      pen.stroke();
    }
    return;
  }
  handles.forEach(({ azimuth, elevation, size }, index) => {
    const to = direction(azimuth, elevation);
    const off = (Math.acos(to[2]) * 90) / Math.PI; // half the angle from the camera
    // From the lamp's inner end to its outer one.
    const [inner, outer] = [-1, 1].map((way) => Math.sin(((off + (way * size) / 2) * Math.PI) / 180));
    circle(place(to), ((outer - inner) / 2) * REACH * radius);
    pen.strokeStyle = style.getPropertyValue(index === chosen ? "--accent" : "--edge") || "gray";
    pen.lineWidth = index === chosen ? 1.5 : 1;
    pen.stroke();
  });
}
