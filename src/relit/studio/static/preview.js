// @ts-check
/**
 * The live preview. While a hand moves, quick pictures follow it, one at a time and always of the newest wish;
 * when it rests, a fine one is made, and called off should it move again.
 */

import { isAborted } from "./api.js";

const REST = 200; // ms without a change before a fine picture is asked for
const PATIENCE = 300; // ms after which the user is told that work goes on

/**
 * @typedef {{view: string, blob: Blob, window: number[], views: string[], finest: number,
 *   seconds: number, lamps: [number, number, number, string][], fill: number, confidence: number}} Picture
 */

/**
 * @typedef {{options: object, reference: string | null, views: string[], side: number, fine: number}} Wish
 *   px of quick pictures, and of fine ones
 */

export class Preview extends EventTarget {
  /**
   * @param {(request: object, signal: AbortSignal) => Promise<Response>} render
   * @param {() => Promise<void>} prepare bring the server up to date
   */
  constructor(render, prepare) {
    super();
    this.render = render;
    this.prepare = prepare;
    this.sequence = 0;
    /** @type {Wish | null} what nobody works on yet */
    this.next = null;
    this.following = false;
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.rest = undefined;
  }

  /** @param {Wish} wish */
  ask(wish) {
    this.next = wish;
    clearTimeout(this.rest);
    this.#say("settled", false);
    if (!this.following) void this.#follow();
  }

  cancel() {
    this.next = null;
    clearTimeout(this.rest);
    this.running?.abort();
    this.#say("settled", true);
  }

  async #follow() {
    this.following = true;
    this.running?.abort(); // a fine picture
    /** @type {Wish | null} */
    let shown = null;
    while (this.next) {
      const wish = this.next;
      this.next = null;
      shown = (await this.#show(wish, true)) ? wish : null;
    }
    this.following = false;
    if (shown) this.rest = setTimeout(this.#refine.bind(this, shown), REST);
    else this.#say("settled", true);
  }

  /** @param {Wish} wish */
  async #refine(wish) {
    if (await this.#show(wish, false)) this.#say("done", null);
    if (!this.following) this.#say("settled", true);
  }

  /** @param {Wish} wish @param {boolean} quick @returns {Promise<boolean>} whether it was shown */
  async #show({ options, reference, views, side: rough, fine }, quick) {
    const side = quick ? rough : fine;
    const control = (this.running = new AbortController());
    const { signal } = control;
    const slow = setTimeout(() => this.#say("busy", true), PATIENCE);
    try {
      await this.prepare();
      for (const view of views) {
        if (signal.aborted) return false;
        // Clocks go on when the page is loaded again, and so does the order of requests.
        this.sequence = Math.max(this.sequence + 1, Date.now());
        const response = await this.render({ options, reference, view, side, quick, sequence: this.sequence }, signal);
        const made = await picture(view, response);
        if (!signal.aborted) this.#say("picture", made);
      }
      return !signal.aborted;
    } catch (error) {
      const overtaken = signal.aborted || isAborted(error) || /** @type {any} */ (error).code === "stale";
      if (!overtaken) this.#say("problem", error);
      return false;
    } finally {
      clearTimeout(slow);
      if (this.running === control) this.#say("busy", false);
    }
  }

  /** @param {string} type @param {unknown} detail */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** @param {string} view @param {Response} response @returns {Promise<Picture>} */
async function picture(view, response) {
  /** @param {string} name */
  const header = (name) => response.headers.get(`X-Relit-${name}`) ?? "";
  return {
    view,
    blob: await response.blob(),
    window: header("Window").split(",").map(Number),
    views: header("Views").split(",").map((name) => name.trim()),
    finest: Number(header("Lambda-Px")) || 0,
    seconds: Number(header("Seconds")) || 0,
    lamps: JSON.parse(header("Lamps") || "[]"),
    fill: Number(header("Fill")) || 0,
    confidence: Number(header("Confidence") || 1),
  };
}
