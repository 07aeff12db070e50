// @ts-check
/** The live preview: the newest request wins, older ones are called off. */

import { isAborted } from "./api.js";

const SETTLE = 30; // ms without a change before the server is asked
const PATIENCE = 300; // ms after which the user is told that work goes on

/**
 * @typedef {{view: string, blob: Blob, window: number[], views: string[], finest: number, seconds: number}} Picture
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
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** @param {{options: object, views: string[], side: number}} wanted */
  ask(wanted) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#run(wanted), SETTLE);
  }

  cancel() {
    clearTimeout(this.timer);
    this.running?.abort();
  }

  /** @param {{options: object, views: string[], side: number}} wanted */
  async #run({ options, views, side }) {
    this.running?.abort();
    const control = (this.running = new AbortController());
    const slow = setTimeout(() => this.#say("busy", true), PATIENCE);
    try {
      await this.prepare();
      for (const view of views) {
        if (control.signal.aborted) return;
        // Clocks go on when the page is loaded again, and so does the order of requests.
        this.sequence = Math.max(this.sequence + 1, Date.now());
        const response = await this.render({ options, view, side, sequence: this.sequence }, control.signal);
        const made = await picture(view, response);
        if (!control.signal.aborted) this.#say("picture", made);
      }
      if (!control.signal.aborted) this.#say("done", null);
    } catch (error) {
      const overtaken = control.signal.aborted || isAborted(error) || /** @type {any} */ (error).code === "stale";
      if (!overtaken) this.#say("problem", error);
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
  };
}
