// @ts-check
/** The references that were dropped so far, and the lights by name: looks to choose from. */

import { ApiError, isAborted } from "./api.js";
import { Looks } from "./looks.js";
import { BESIDE } from "./strip.js";

/**
 * @typedef {import("./api.js").Photo} Photo
 * @typedef {import("./looks.js").Look} Look
 */

const SIDE = 192; // px of a look's picture

export class Gallery extends EventTarget {
  /**
   * @param {HTMLElement} root @param {import("./api.js").Session} session @param {string[]} lights
   * @param {() => {options: Record<string, any>, sequence: number} | null} now what looks are made of; null: nothing yet
   */
  constructor(root, session, lights, now) {
    super();
    this.session = session;
    this.lights = lights;
    this.now = now;
    /** @type {Record<string, string>} id → name of the file */
    this.names = {};
    this.inUse = "";
    this.looks = new Looks(root, (look, signal) => this.#thumbnail(look, signal));
    this.looks.addEventListener("remove", (event) => void this.#remove(/** @type {CustomEvent<Look>} */ (event).detail));
  }

  /** What was there before the page was loaded again. @param {Record<string, string>} names @param {string[]} starred */
  async restore(names, starred) {
    this.looks.starred = new Set(starred);
    const held = await this.session.references();
    // Left behind by an export that the page did not live to see the end of.
    if (BESIDE in held) await this.session.removeReference(BESIDE);
    delete held[BESIDE];
    this.names = Object.fromEntries(Object.keys(held).map((id) => [id, names[id] ?? id]));
    this.show();
  }

  /** Put a file on the server, and make it the reference. @param {File} file @returns {Promise<Photo>} */
  async add(file) {
    const id = crypto.randomUUID?.() ?? `${Date.now()}-${Object.keys(this.names).length}`;
    await this.session.addReference(id, file);
    this.names[id] = file.name;
    this.show();
    return this.use(id);
  }

  /** The server has one as its reference. @param {string} id @param {string} name */
  seat(id, name) {
    this.names[id] = name;
    this.inUse = id;
    this.show();
  }

  /** Make one the reference. @param {string} id @returns {Promise<Photo>} */
  async use(id) {
    const seats = await this.session.chooseReference(id);
    this.inUse = id;
    return /** @type {Photo} */ (seats.reference);
  }

  show() {
    this.looks.show([
      ...this.lights.map((light) => ({ key: `light ${light}`, label: titled(light), light, reference: null })),
      ...Object.entries(this.names).map(([id, name]) => ({ key: `photo ${id}`, label: name, light: null, reference: id })),
    ]);
  }

  /** @param {string | null} light @param {string} reference */
  mark(light, reference) {
    this.looks.mark(light ? `light ${light}` : reference ? `photo ${reference}` : null);
  }

  /** @param {Look} look @param {AbortSignal} signal @returns {Promise<Blob | null>} */
  async #thumbnail({ light, reference }, signal) {
    const now = this.now();
    if (!now) return null;
    const request = { options: { ...now.options, light }, reference, view: "result", side: SIDE, quick: true, sequence: now.sequence };
    try {
      return await (await this.session.render(request, signal)).blob();
    } catch (error) {
      if (isAborted(error)) return null;
      // A preview has overtaken it: later. What cannot be made has no picture.
      if (error instanceof ApiError) return error.code === "stale" ? null : new Blob();
      throw error;
    }
  }

  /** @param {Look} look */
  async #remove({ reference }) {
    const id = /** @type {string} */ (reference);
    delete this.names[id];
    this.show();
    await this.session.removeReference(id);
    this.dispatchEvent(new CustomEvent("gone", { detail: id }));
  }
}

/** @param {string} word */
const titled = (word) => word[0].toUpperCase() + word.slice(1);
