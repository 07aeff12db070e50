// @ts-check
/** A film strip of photos that wait for the same light, and their export one after the other. */

import { ApiError } from "./api.js";
import { toSend } from "./pairs.js";
import { zipped } from "./zip.js";

/** Files that a browser shows. */
const SHOWN = ["image/jpeg", "image/png", "image/webp"];

/** Where the server keeps the photo of a film strip that is relit next. */
export const BESIDE = "film";

/**
 * @typedef {import("./api.js").Marks} Marks
 * @typedef {{name: string, file: File, problem: string, lost: string[], marks: Marks | null}} Frame with the landmarks
 *   that were placed by hand, if any were
 * @typedef {{options: Record<string, any>, reference: string | null, marks: Marks | null, format: string}} Light
 *   what a set is lit by: with the reference's landmarks
 */

export class FilmStrip extends EventTarget {
  /**
   * @param {HTMLElement} root holding a list, a button that exports and one that stops, a progress bar and a line
   * @param {import("./api.js").Session} session
   * @param {() => Promise<Light>} light in use
   */
  constructor(root, session, light) {
    super();
    this.root = root;
    this.session = session;
    this.light = light;
    /** @type {Frame[]} */
    this.frames = [];
    this.chosen = -1;
    this.list = this.#part("ol");
    this.run = new AbortController();
    /** @type {Light | null} while a set is relit */
    this.lit = null;
    this.#part("[data-do=all]").addEventListener("click", () => void this.#export());
    this.#part("[data-do=stop]").addEventListener("click", () => this.run.abort());
  }

  /** @param {File[]} files */
  add(files) {
    for (const file of files) {
      this.frames.push({ name: file.name, file, problem: "", lost: [], marks: null });
      this.list.append(this.#item(file, this.frames.length - 1));
    }
    this.#draw();
  }

  clear() {
    this.run.abort();
    this.frames = [];
    this.chosen = -1;
    for (const image of this.list.querySelectorAll("img")) URL.revokeObjectURL(image.src);
    this.list.replaceChildren();
    this.#draw();
  }

  /** @param {number} at */
  choose(at) {
    this.chosen = at;
    this.#draw();
    this.dispatchEvent(new CustomEvent("choose", { detail: this.frames[at] }));
  }

  /** What became of one that was chosen, unless another has been since. @param {Frame} frame @param {string} problem @param {File | null} file in hand */
  told(frame, problem, file) {
    if (this.frames[this.chosen] !== frame) return;
    frame.problem = problem;
    this.inHand(file);
  }

  /** The photo that is in hand, which may be none of these. @param {File | null} file */
  inHand(file) {
    this.chosen = this.frames.findIndex((frame) => frame.file === file);
    this.#draw();
  }

  /** The frame of a file. @param {File | null | undefined} file */
  frame(file) {
    return this.frames.find((frame) => frame.file === file);
  }

  /** The landmarks of a photo in hand, which may be none of these. @param {File | null} file @param {Marks | null} marks */
  placed(file, marks) {
    const frame = this.frame(file);
    if (!frame) return;
    frame.marks = marks?.detected ? null : marks;
    if (!frame.marks || !frame.problem) return;
    frame.problem = "";
    this.#draw();
  }

  /** The reference in use is about to leave its seat. One that is not at hand lights no more of a set. */
  left() {
    if (this.lit && !this.lit.reference && !this.lit.options.light) this.run.abort();
  }

  /** Relight all, and save them together; what is refused is told, and the others go on. */
  async #export() {
    const { signal } = (this.run = new AbortController());
    this.#busy(true);
    try {
      this.lit = await this.light();
      const made = await this.#relitAll([...this.frames], this.lit, signal);
      if (made.length) this.dispatchEvent(new CustomEvent("made", { detail: await zipped(distinct(made)) }));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.#say(error.message);
    } finally {
      this.lit = null;
      this.#busy(false);
      this.#draw();
    }
  }

  /** @param {Frame[]} frames @param {Light} light @param {AbortSignal} signal */
  async #relitAll(frames, light, signal) {
    const bar = /** @type {HTMLProgressElement} */ (this.#part("progress"));
    bar.max = frames.length;
    const made = [];
    let ended = "";
    for (const [k, frame] of frames.entries()) {
      if (signal.aborted || ended) break;
      bar.value = k;
      this.#say(`${k + 1} of ${frames.length}: ${frame.name}`);
      try {
        const { file, lost } = await this.#relit(frame, light, signal);
        made.push({ name: frame.name.replace(/(\.[^.]*)?$/, light.format), blob: file });
        Object.assign(frame, { problem: "", lost });
      } catch (error) {
        const { message } = /** @type {Error} */ (error);
        // None of the others would fare better.
        if (error instanceof ApiError && ["not_found", "unreachable"].includes(error.code)) ended = message;
        else if (!signal.aborted) Object.assign(frame, { problem: message, lost: [] });
      }
    }
    await this.#forget();
    const bad = frames.filter(({ problem }) => problem).length;
    const lost = [...new Set(frames.flatMap((frame) => frame.lost))];
    const whole = !signal.aborted && !ended;
    const told = [whole ? `${made.length} photos relit.` : `Stopped after ${made.length} of ${frames.length}.`, ended];
    if (bad) told.push(`${bad} could not be: see the marks on them.`);
    if (lost.length) told.push(`This format does not keep ${lost.join(", ")}.`);
    this.#say(told.filter(Boolean).join(" "));
    return made;
  }

  /** @param {Frame} frame @param {Light} light @param {AbortSignal} signal */
  async #relit({ file, marks }, { marks: reference, ...light }, signal) {
    // Beside the photo that is in hand, which stays.
    const { message } = await this.session.addReference(BESIDE, file, signal);
    const placed = toSend({ target: marks, reference }, "target");
    if (placed) await this.session.placeReference(BESIDE, placed);
    else if (message) throw new Error(message);
    return this.session.export({ ...light, target: BESIDE }, signal);
  }

  async #forget() {
    try {
      await this.session.removeReference(BESIDE);
    } catch (error) {
      // It need not have come so far.
      if (!(error instanceof ApiError)) throw error;
    }
  }

  #draw() {
    this.root.hidden = this.frames.length < 2;
    this.list.querySelectorAll("button").forEach((/** @type {HTMLElement} */ button, /** @type {number} */ k) => {
      const { problem, lost } = this.frames[k];
      const told = problem || (lost.length ? `Saved without ${lost.join(", ")}.` : "");
      button.title = told;
      button.setAttribute("aria-current", String(k === this.chosen));
      button.classList.toggle("bad", Boolean(problem));
      if (told) button.setAttribute("aria-description", told);
      else button.removeAttribute("aria-description");
    });
  }

  /** @param {File} file @param {number} at */
  #item(file, at) {
    const item = document.createElement("li");
    const button = Object.assign(document.createElement("button"), { type: "button" });
    if (SHOWN.includes(file.type)) {
      button.append(Object.assign(new Image(), { alt: "", draggable: false, decoding: "async", src: URL.createObjectURL(file) }));
    }
    button.append(file.name);
    button.addEventListener("click", () => this.choose(at));
    item.append(button);
    return item;
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
