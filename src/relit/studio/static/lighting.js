// @ts-check
/** Which light is in use: of lamps or of a photo, by the ball, by a look, or by a key. */

import { LightDesk } from "./desk.js";
import { Gallery } from "./gallery.js";
import { typed } from "./hold.js";
import { Newest } from "./newest.js";

/** Options that carry a light; another light begins without them. */
const CARRIED = { turn: 0, tilt: 0 };

export class Lighting extends EventTarget {
  /**
   * @param {import("./api.js").Session} session @param {import("./api.js").Offer} offer
   * @param {import("./state.js").Store<import("./main.js").Document>} store
   * @param {HTMLElement} desk @param {HTMLElement} looks
   * @param {() => number | null} sequence of the last preview; null while there can be none
   */
  constructor(session, offer, store, desk, looks, sequence) {
    super();
    this.store = store;
    this.newest = new Newest(); // of all lights that were wished for
    this.desk = new LightDesk(desk, offer.lights);
    this.gallery = new Gallery(looks, session, Object.keys(offer.lights), () => {
      const now = sequence();
      return now === null ? null : { options: { ...store.now.options, ...CARRIED }, sequence: now };
    });
    this.desk.addEventListener("change", (event) => this.#set(/** @type {CustomEvent} */ (event).detail, "lamp"));
    this.desk.addEventListener("rest", () => store.pause());
    this.desk.addEventListener("from", (event) => {
      this.#set({ ...CARRIED, light: /** @type {CustomEvent} */ (event).detail }, null);
    });
    this.gallery.looks.addEventListener("choose", (event) => {
      const { light, reference } = /** @type {CustomEvent<import("./looks.js").Look>} */ (event).detail;
      if (reference) this.dispatchEvent(new CustomEvent("reference", { detail: reference }));
      else this.#set({ ...CARRIED, light }, null);
    });
    this.gallery.looks.addEventListener("star", () => this.dispatchEvent(new Event("note")));
    window.addEventListener("keydown", ({ target, key, ctrlKey, metaKey, altKey, defaultPrevented }) => {
      if (!defaultPrevented && !typed(target) && !ctrlKey && !metaKey && !altKey && /^[1-9]$/.test(key)) this.gallery.looks.pick(Number(key));
    });
  }

  /** Options with the light of a photo. */
  get ofPhoto() {
    return { ...this.store.now.options, ...CARRIED, light: null };
  }

  /** @param {boolean} hasReference */
  show(hasReference) {
    const { options, reference } = this.store.now;
    this.desk.show(options, hasReference);
    this.gallery.mark(options.light, reference);
  }

  /** @param {Record<string, any>} changes @param {string | null} tag */
  #set(changes, tag) {
    if ("light" in changes) this.newest.next();
    this.store.set({ options: { ...this.store.now.options, ...changes } }, tag);
  }
}
