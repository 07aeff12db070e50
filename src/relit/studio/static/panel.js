// @ts-check
/** One photo of the pair: its frame, its points, its files. */

import { dropZone, onChosen } from "./files.js";
import { PointEditor } from "./points.js";
import { Viewport } from "./viewport.js";

/** @typedef {import("./api.js").Role} Role */

const MEANING = { target: "the person", reference: "the light" };

export class Panel extends EventTarget {
  /** @param {Role} role @param {HTMLTemplateElement} template @param {string[]} formats */
  constructor(role, template, formats) {
    super();
    this.role = role;
    this.root = /** @type {HTMLElement} */ (
      /** @type {DocumentFragment} */ (template.content.cloneNode(true)).firstElementChild
    );
    this.root.dataset.role = role;
    const title = role[0].toUpperCase() + role.slice(1);
    const heading = this.part("h3");
    heading.id = `${role}-title`;
    heading.append(title, Object.assign(document.createElement("small"), { textContent: ` ${MEANING[role]}` }));
    this.root.setAttribute("aria-labelledby", heading.id);
    this.frame = this.part(".frame");
    this.frame.setAttribute("aria-label", `${title}: landmarks`);
    this.frame.setAttribute("aria-roledescription", "landmark editor");
    this.part(".frame .empty").textContent = `Drop the ${role} here`;
    const choose = /** @type {HTMLInputElement} */ (this.part(".head input"));
    choose.setAttribute("aria-label", `Choose the ${role} photo`);
    const files = (/** @type {File[]} */ files) => this.#say("files", files);
    dropZone(this.root, files);
    onChosen(choose, files);
    const load = /** @type {HTMLInputElement} */ (this.part(".landmark-file"));
    load.accept = formats.join(",");
    load.setAttribute("aria-label", `Load landmarks of the ${role}`);
    onChosen(load, ([file]) => this.#say("marks", file));
    this.format = /** @type {HTMLSelectElement} */ (this.part(".landmark-format"));
    this.format.setAttribute("aria-label", `Format of the ${role}'s landmark file`);
    for (const format of formats) this.format.append(new Option(format));
    this.viewport = new Viewport(this.frame);
    this.points = new PointEditor(this.frame, this.viewport);
    this.on("out", () => this.viewport.zoom(0.7));
    this.on("in", () => this.viewport.zoom(1.4));
    this.on("fit", () => this.viewport.fit());
    this.on("save", () => this.#say("save", this.format.value));
    this.picture = /** @type {HTMLImageElement} */ (this.part(".frame img"));
    this.tasks = 0;
    this.filled(false);
  }

  /** @param {string} selector */
  part(selector) {
    return /** @type {HTMLElement} */ (this.root.querySelector(selector));
  }

  /** @param {string} name @param {() => void} act */
  on(name, act) {
    this.part(`[data-do=${name}]`).addEventListener("click", act);
  }

  /** @param {boolean} yes */
  filled(yes) {
    this.root.classList.toggle("filled", yes);
    this.picture.hidden = !yes;
  }

  /** @param {Blob} blob @param {import("./api.js").Photo} photo @param {string} name */
  show(blob, photo, name) {
    URL.revokeObjectURL(this.picture.src);
    this.picture.src = URL.createObjectURL(blob);
    this.picture.alt = `${this.role}${name ? `: ${name}` : ""}`;
    this.part(".facts").textContent = [name, `${photo.width} × ${photo.height}`].filter(Boolean).join(" · ");
    this.frame.style.setProperty("--ratio", String(photo.width / photo.height));
    this.filled(true);
    this.viewport.show(photo.width, photo.height, photo.landmarks?.points ?? []);
  }

  /** @param {string} text */
  problem(text) {
    this.part(".problem").textContent = text;
  }

  /** One task more, or one less: there may be several at once. @param {boolean} yes */
  busy(yes) {
    this.tasks += yes ? 1 : -1;
    this.root.classList.toggle("busy", this.tasks > 0);
    this.root.setAttribute("aria-busy", String(this.tasks > 0));
  }

  /** @param {string} type @param {unknown} detail */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
