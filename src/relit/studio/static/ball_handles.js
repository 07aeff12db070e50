// @ts-check
/** The dots on the light ball, a button for each lamp, in the order in which Tab comes to them. */

import { direction, place, spoken } from "./sphere.js";

export class Handles {
  /** @param {HTMLElement} root @param {(index: number) => void} choose */
  constructor(root, choose) {
    this.root = root;
    this.choose = choose;
    /** @type {HTMLButtonElement[]} */
    this.buttons = [];
  }

  /** @param {import("./ball.js").Handle[]} lamps @param {number} chosen @param {number} radius CSS px of the ball */
  show(lamps, chosen, radius) {
    while (this.buttons.length > lamps.length) this.buttons.pop()?.remove();
    while (this.buttons.length < lamps.length) this.buttons.push(this.#button(this.buttons.length));
    lamps.forEach(({ azimuth, elevation, color, size }, index) => {
      const button = this.buttons[index];
      const [x, y] = place(direction(azimuth, elevation));
      button.style.translate = `${x * radius}px ${y * radius}px`;
      button.style.backgroundColor = color;
      const where = `${spoken(azimuth, elevation)}, ${Math.round(size)}° soft`;
      button.setAttribute("aria-label", `Lamp ${index + 1} of ${lamps.length}: ${where}`);
      button.setAttribute("aria-pressed", String(index === chosen));
    });
  }

  /** Go so many lamps on from one. @param {number} index @param {number} by */
  step(index, by) {
    const { length } = this.buttons;
    if (length) this.buttons[(index + by + length) % length].focus();
  }

  /** @param {number} index */
  #button(index) {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.index = String(index);
    button.addEventListener("focus", () => this.choose(index));
    this.root.append(button);
    return button;
  }
}
