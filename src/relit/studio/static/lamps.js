// @ts-check
/** A light as text, as the option takes it, and as lamps that can be taken hold of. */

/**
 * @typedef {{azimuth: number, elevation: number, size: number, power: number, color: string, name: string | null}} Lamp
 * @typedef {Record<string, {azimuth: number, elevation: number, size: number}>} Known lights by name
 */

export const WHITE = "#ffffff";
const SIZE = 10; // degrees from the middle of a lamp to its rim that a plain one has

/**
 * The lamps of a text that the server takes; of one that it would refuse, those that can be read.
 * @param {string} text @param {Known} known
 * @returns {Lamp[]}
 */
export function lampsOf(text, known) {
  // The + of an exponent or a sign comes after nothing that ends a lamp.
  return text.split(/(?<=[^,:=+\s])\s*\+/).flatMap((part) => {
    const [place, ...settings] = part.split(":").map((one) => one.trim());
    const named = known[place];
    const [azimuth, elevation] = named ? [named.azimuth, named.elevation] : place.split(",").map(Number);
    if (!Number.isFinite(azimuth) || !Number.isFinite(elevation)) return [];
    const given = Object.fromEntries(settings.map((one) => one.split("=").map((word) => word.trim())));
    return {
      azimuth,
      elevation,
      size: Number(given.size ?? named?.size ?? SIZE),
      power: Number(given.power ?? 1),
      color: given.color ?? WHITE,
      name: named ? place : null,
    };
  });
}

/** @param {Lamp[]} lamps @param {Known} known @returns {string} */
export function textOf(lamps, known) {
  return lamps
    .map(({ azimuth, elevation, size, power, color, name }) => {
      const usual = name ? known[name].size : SIZE;
      return [
        name ?? `${round(azimuth)},${round(elevation)}`,
        size === usual ? "" : `:size=${round(size)}`,
        power === 1 ? "" : `:power=${round(power)}`,
        color.toLowerCase() === WHITE ? "" : `:color=${color}`,
      ].join("");
    })
    .join("+");
}

/** @param {number} value */
const round = (value) => Number(value.toFixed(1));
