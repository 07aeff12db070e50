// @ts-check
/**
 * Directions of light on a flat picture of all directions, and a matt ball in that light.
 *
 * The map is Lambert's azimuthal one, as in a photo of a mirror ball: the camera is in the middle, the ball's rim
 * is where light comes from the side, and straight behind is the edge. It has an inverse everywhere, and a degree
 * is almost as long at the rim as in the middle, which it is not when directions are seen from straight ahead.
 */

/** @typedef {[azimuth: number, elevation: number, power: number, color: string]} Lamp */

/** Where the map ends, in radii of the ball. */
export const REACH = Math.SQRT2;

const RADIAN = Math.PI / 180;
const STEPS = 4096; // of the table of sRGB's curve: less than a level of 8 bits each

/** sRGB's curve (IEC 61966-2-1), from light in [0, 1]. @param {number} light */
const encode = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
const CURVE = Uint8ClampedArray.from({ length: STEPS + 1 }, (_, step) => Math.round(255 * encode(step / STEPS)));

/** The light of a color such as #ffd9a0. @param {string} color */
export function linear(color) {
  return [1, 3, 5].map((at) => {
    const value = parseInt(color.slice(at, at + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
}

/** The unit vector towards a lamp: to the right, upwards, to the camera. @param {number} azimuth @param {number} elevation */
export function direction(azimuth, elevation) {
  const level = Math.cos(elevation * RADIAN);
  return [Math.sin(azimuth * RADIAN) * level, Math.sin(elevation * RADIAN), Math.cos(azimuth * RADIAN) * level];
}

/** Azimuth and elevation in degrees. @param {number[]} vector of length 1 */
export function angles([x, y, z]) {
  return [Math.atan2(x, z) / RADIAN, Math.asin(Math.min(Math.max(y, -1), 1)) / RADIAN];
}

/** Where a direction is on the map: radii to the right and down. @param {number[]} vector of length 1 */
export function place([x, y, z]) {
  // Straight behind is the whole edge, of which this is the upper end.
  if (z < 1e-12 - 1) return [0, -REACH];
  return [x, -y].map((along) => along / Math.sqrt(1 + z));
}

/** The direction at a place of the map; beyond its edge, that of the nearest place. @param {number} x @param {number} y */
export function fromPlace(x, y) {
  const beyond = Math.max(Math.hypot(x, y) / REACH, 1);
  const [right, down] = [x / beyond, y / beyond];
  const squared = Math.min(right ** 2 + down ** 2, 2);
  const level = Math.sqrt(2 - squared);
  return [right * level, -down * level, 1 - squared];
}

/** Where a lamp stands, in words. @param {number} azimuth @param {number} elevation */
export function spoken(azimuth, elevation) {
  const [aside, height] = [Math.round(azimuth), Math.round(elevation)];
  const words = [
    aside && `${Math.abs(aside)}° to the ${aside < 0 ? "left" : "right"}`,
    height && `${Math.abs(height)}° ${height < 0 ? "down" : "up"}`,
    Math.abs(aside) > 90 && "behind the head",
  ].filter(Boolean);
  return words.join(", ") || "at the camera";
}

/**
 * Pixels of a matt white ball: by Lambert's law, and as bright as the picture can be where most light falls on it.
 * @param {number} side px of the square picture @param {number} radius px of the ball in its middle
 * @param {Lamp[]} lamps @param {number} fill share of the light that comes from everywhere
 */
export function shade(side, radius, lamps, fill) {
  const rays = lamps.map(([azimuth, elevation, power, color]) => {
    return [...direction(azimuth, elevation), ...linear(color).map((light) => light * power)];
  });
  const flat = Float64Array.from(rays.flat());
  const lit = new Float64Array(3);
  const receive = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => {
    // Three numbers of their own: arrays that are made and unpacked take three times as long.
    let red = 0;
    let green = 0;
    let blue = 0;
    for (let at = 0; at < flat.length; at += 6) {
      const straight = flat[at] * x + flat[at + 1] * y + flat[at + 2] * z;
      if (straight <= 0) continue;
      red += flat[at + 3] * straight;
      green += flat[at + 4] * straight;
      blue += flat[at + 5] * straight;
    }
    lit[0] = red;
    lit[1] = green;
    lit[2] = blue;
  };
  // The most light falls on what looks into a lamp, or into the middle of several.
  const middle = [0, 1, 2].map((axis) => rays.reduce((sum, ray) => sum + ray[axis] * (ray[3] + ray[4] + ray[5]), 0));
  const length = Math.hypot(...middle) || 1;
  let most = 0;
  for (const [x, y, z] of [...rays, middle.map((along) => along / length)]) {
    receive(x, y, z);
    most = Math.max(most, ...lit);
  }
  const gain = most ? (1 - fill) / most : 0;

  const pixels = new Uint8ClampedArray(4 * side * side);
  for (let row = 0, at = 0; row < side; row += 1) {
    for (let column = 0; column < side; column += 1, at += 4) {
      let x = (column + 0.5 - side / 2) / radius;
      let y = (side / 2 - row - 0.5) / radius;
      const far = Math.sqrt(x * x + y * y);
      // Pixels that the rim runs through are seen in part.
      const seen = (1 - far) * radius + 0.5;
      if (seen <= 0) continue;
      if (far > 1) [x, y] = [x / far, y / far];
      receive(x, y, Math.sqrt(Math.max(1 - far * far, 0)));
      for (let k = 0; k < 3; k += 1) {
        pixels[at + k] = CURVE[Math.round(STEPS * Math.min(gain * lit[k] + fill, 1))];
      }
      pixels[at + 3] = 255 * Math.min(seen, 1);
    }
  }
  return pixels;
}
