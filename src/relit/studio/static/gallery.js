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
    /** @type {Map<string, File>} those of the names that the page has itself */
    this.files = new Map();
    this.inUse = ""; // the one that the server has as its reference; empty: one that is not at hand, or none
    this.asked = ""; // the one that it was asked to have
    this.looks = new Looks(root, (look, signal) => this.#thumbnail(look, signal));
    this.looks.addEventListener("remove", (event) => {
      const { reference } = /** @type {CustomEvent<Look>} */ (event).detail;
      this.dispatchEvent(new CustomEvent("remove", { detail: reference }));
    });
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

  /** Put a file on the server. @param {File} file @returns {Promise<string>} by which it is at hand */
  async add(file) {
    const id = crypto.randomUUID?.() ?? `${Date.now()}-${Object.keys(this.names).length}`;
    await this.session.addReference(id, file);
    this.names[id] = file.name;
    this.files.set(id, file);
    this.show();
    return id;
  }

  /** The server has one as its reference. @param {string} id @param {string} name */
  seat(id, name) {
    this.names[id] = name;
    this.inUse = this.asked = id;
    this.show();
  }

  /** Make one the reference. @param {string} id @param {AbortSignal} signal @returns {Promise<Photo>} */
  async use(id, signal) {
    this.asked = id;
    try {
      const seats = await this.session.chooseReference(id, signal);
      this.inUse = id;
      return /** @type {Photo} */ (seats.reference);
    } catch (error) {
      if (this.asked === id) this.asked = this.inUse;
      throw error;
    }
  }

  /** Take one out. It stays the reference, if it is. @param {string} id */
  async remove(id) {
    await this.session.removeReference(id);
    delete this.names[id];
    this.files.delete(id);
    if (this.inUse === id) this.inUse = this.asked = "";
    this.show();
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
}

/** @param {string} word */
const titled = (word) => word[0].toUpperCase() + word.slice(1);
