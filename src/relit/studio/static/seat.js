// @ts-check
/** The seat of the reference: which of the photos at hand the server has in it, now and as the history goes. */

import { Newest } from "./newest.js";

/**
 * @typedef {import("./api.js").Photo} Photo
 * @typedef {object} Page
 * @property {(role: "reference" | null, act: () => Promise<void>) => Promise<void>} attempt do what the server may refuse
 * @property {() => void} leaving the one that is there
 * @property {(id: string, name: string) => void} taken one is there
 * @property {(photo: Photo, signal: AbortSignal) => Promise<void>} show
 * @property {() => void} note
 */

export class Seat {
  /**
   * @param {import("./gallery.js").Gallery} gallery @param {import("./sync.js").Sync} sync
   * @param {import("./state.js").Store<import("./main.js").Document>} store
   * @param {import("./lighting.js").Lighting} lighting @param {Page} page
   */
  constructor(gallery, sync, store, lighting, page) {
    this.gallery = gallery;
    this.sync = sync;
    this.store = store;
    this.lighting = lighting;
    this.page = page;
    this.newest = new Newest();
    this.settled = Promise.resolve(); // once the server has the one that is chosen
    store.addEventListener("change", (event) => this.#follow(/** @type {CustomEvent} */ (event).detail.before));
    gallery.addEventListener("remove", (event) => this.#remove(/** @type {CustomEvent<string>} */ (event).detail));
  }

  /** Take the light of a reference at hand. @param {string} id @returns {Promise<void>} */
  choose(id) {
    const wish = this.lighting.newest.next();
    return this.#ask(async () => {
      const reference = await this.#take(id);
      const change = { faces: { target: this.store.now.faces.target, reference }, reference: id };
      // A lamp that was chosen meanwhile stays.
      if (wish.aborted) this.store.settle(change);
      else this.store.set({ ...change, options: this.lighting.ofPhoto });
      this.page.note();
    });
  }

  /** @param {() => Promise<void>} act */
  #ask(act) {
    this.settled = this.page.attempt("reference", () => this.sync.exchange(["reference"], act));
    return this.settled;
  }

  /** Show a reference that is at hand, once the server has it in its seat. @param {string} id */
  async #take(id) {
    const signal = this.newest.next();
    const name = this.gallery.names[id];
    this.page.leaving();
    const photo = await this.gallery.use(id, signal);
    this.page.taken(id, name);
    this.sync.knows("reference", { target: null, reference: photo.landmarks });
    await this.page.show(photo, signal);
    return photo.landmarks;
  }

  /** Undo and redo change what is in the seat. @param {import("./main.js").Document} before */
  #follow(before) {
    const { reference } = this.store.now;
    if (reference === before.reference) return;
    if (!before.reference) this.#forget("");
    if (reference && reference !== this.gallery.asked) void this.#ask(() => this.#take(reference).then(() => {}));
  }

  /** A reference that cannot be had again: what it lit is history no more, and lamps are beside the one now. @param {string} id */
  #forget(id) {
    const { reference, faces } = this.store.now;
    this.store.revise((one) => {
      if (one.reference !== id) return one;
      return one.options.light ? { ...one, reference, faces: { ...one.faces, reference: faces.reference } } : null;
    });
  }

  /** @param {string} id */
  async #remove(id) {
    await this.settled; // it may be about to come into use
    if (!(id in this.gallery.names)) return;
    await this.page.attempt(null, async () => {
      await this.gallery.remove(id);
      // In use, it stays so.
      if (this.store.now.reference === id) {
        this.store.map((one) => (one.reference === id ? { ...one, reference: "" } : one));
      } else this.#forget(id);
      this.page.note();
    });
  }
}
