// @ts-check
/** A film strip of photos that wait for the same light, and their export one after the other. */

import { zipped } from "./zip.js";

/** Where the server keeps the photo of a film strip that is relit next. */
export const BESIDE = "film";

/** @typedef {{name: string, file: File, problem: string, lost: string[]}} Frame */

export class FilmStrip extends EventTarget {
  /**
   * @param {HTMLElement} root holding a list, a button that exports and one that stops, a progress bar and a line
   * @param {import("./api.js").Session} session
   */
  constructor(root, session) {
    super();
    this.root = root;
    this.session = session;
    /** @type {Frame[]} */
    this.frames = [];
    this.chosen = -1;
    this.seen = -1; // which one the page shows
    this.list = this.#part("ol");
    this.run = new AbortController();
    this.#part("[data-do=all]").addEventListener("click", () => this.dispatchEvent(new Event("all")));
    this.#part("[data-do=stop]").addEventListener("click", () => this.run.abort());
  }

  /** @param {File[]} files */
  add(files) {
    this.frames.push(...files.map((file) => ({ name: file.name, file, problem: "", lost: [] })));
    this.#draw();
  }

  clear() {
    this.frames = [];
    this.chosen = this.seen = -1;
    this.#draw();
  }

  /** @param {number} at */
  choose(at) {
    this.chosen = at;
    this.#draw();
    this.dispatchEvent(new CustomEvent("choose", { detail: { at, file: this.frames[at].file } }));
  }

  /** What became of one that was chosen. @param {number} at @param {boolean} shown @param {string} problem */
  told(at, shown, problem) {
    if (!this.frames[at]) return; // of a strip that is gone
    this.frames[at].problem = problem;
    if (shown) this.seen = at;
    else if (this.chosen === at) this.chosen = this.seen;
    this.#draw();
  }

  /**
   * Relight all, and save them together; what is refused is told, and the others go on.
   * @param {object} options @param {string} format
   * @returns {Promise<Blob | null>} null where none was made
   */
  async export(options, format) {
    const { signal } = (this.run = new AbortController());
    const bar = /** @type {HTMLProgressElement} */ (this.#part("progress"));
    const made = [];
    this.#busy(true);
    bar.max = this.frames.length;
    for (const [k, frame] of this.frames.entries()) {
      if (signal.aborted) break;
      bar.value = k;
      this.#say(`${k + 1} of ${this.frames.length}: ${frame.name}`);
      try {
        const { file, lost } = await this.#relit(frame.file, options, format, signal);
        made.push({ name: frame.name.replace(/(\.[^.]*)?$/, format), blob: file });
        Object.assign(frame, { problem: "", lost });
      } catch (error) {
        if (!signal.aborted) Object.assign(frame, { problem: /** @type {Error} */ (error).message, lost: [] });
      }
    }
    this.#busy(false);
    this.#draw();
    const bad = this.frames.filter(({ problem }) => problem).length;
    const lost = [...new Set(this.frames.flatMap((frame) => frame.lost))];
    const ended = signal.aborted ? `Stopped after ${made.length} of ${this.frames.length}.` : `${made.length} photos relit.`;
    const told = [ended];
    if (bad) told.push(`${bad} could not be: see the marks on them.`);
    if (lost.length) told.push(`This format does not keep ${lost.join(", ")}.`);
    this.#say(told.join(" "));
    return made.length ? zipped(distinct(made)) : null;
  }

  /** @param {File} file @param {object} options @param {string} format @param {AbortSignal} signal */
  async #relit(file, options, format, signal) {
    // Beside the photo that is in hand, which stays.
    const { message } = await this.session.addReference(BESIDE, file);
    try {
      if (message) throw new Error(message);
      return await this.session.export({ options, format, target: BESIDE }, signal);
    } finally {
      await this.session.removeReference(BESIDE);
    }
  }

  #draw() {
    this.root.hidden = this.frames.length < 2;
    this.list.replaceChildren(
      ...this.frames.map(({ name, problem, lost }, k) => {
        const item = document.createElement("li");
        const told = problem || (lost.length ? `Saved without ${lost.join(", ")}.` : "");
        const button = Object.assign(document.createElement("button"), { type: "button", textContent: name, title: told });
        button.setAttribute("aria-current", String(k === this.chosen));
        button.classList.toggle("bad", Boolean(problem));
        if (told) button.setAttribute("aria-description", told);
        button.addEventListener("click", () => this.choose(k));
        item.append(button);
        return item;
      }),
    );
  }

  /** @param {boolean} yes */
  #busy(yes) {
    this.#part("[data-do=all]").hidden = yes;
    this.#part("[data-do=stop]").hidden = this.#part("progress").hidden = !yes;
  }

  /** @param {string} text */
  #say(text) {
    this.#part("[role=status]").textContent = text;
  }

  /** @param {string} selector @returns {any} */
  #part(selector) {
    return this.root.querySelector(selector);
  }
}

/** Files of which no two have one name. @param {{name: string, blob: Blob}[]} files */
function distinct(files) {
  const taken = new Set();
  return files.map(({ name, blob }) => {
    let free = name;
    for (let k = 2; taken.has(free.toLowerCase()); k += 1) free = name.replace(/(\.[^.]*)?$/, `-${k}$1`);
    taken.add(free.toLowerCase());
    return { name: free, blob };
  });
}
