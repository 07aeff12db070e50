// @ts-check
/** What can be undone: a document that is replaced, never changed in place, and its history. */

const DEPTH = 200;

/** @template T */
export class Store extends EventTarget {
  /** @param {T} document */
  constructor(document) {
    super();
    /** @type {T} */
    this.now = document;
    /** @type {T[]} */
    this.past = [];
    /** @type {T[]} */
    this.future = [];
    /** @type {string | null} */
    this.tag = null;
  }

  /**
   * Change the document. Changes of one tag in a row (one drag, one slider) are one step of the history.
   * @param {Partial<T>} changes
   * @param {string | null} [tag]
   */
  set(changes, tag = null) {
    if (tag === null || tag !== this.tag) {
      this.past = [...this.past.slice(1 - DEPTH), this.now];
    }
    this.future = [];
    this.tag = tag;
    this.#become({ ...this.now, ...changes });
  }

  /** Change what the server said of the document; that is no step of its own. @param {Partial<T>} changes */
  settle(changes) {
    this.#become({ ...this.now, ...changes });
  }

  /** End the run of changes that count as one. */
  pause() {
    this.tag = null;
  }

  /** Begin anew: photos that were replaced do not come back. @param {Partial<T>} changes */
  reset(changes) {
    this.past = [];
    this.future = [];
    this.tag = null;
    this.#become({ ...this.now, ...changes });
  }

  /** Change the document and all of its history alike. @param {(document: T) => T} change */
  map(change) {
    this.revise(change);
    this.#become(change(this.now));
  }

  /** Change the history alone; what becomes null is left out. @param {(document: T) => T | null} change */
  revise(change) {
    const kept = (/** @type {T[]} */ documents) => /** @type {T[]} */ (documents.map(change).filter((one) => one !== null));
    this.past = kept(this.past);
    this.future = kept(this.future);
  }

  undo() {
    this.#step(this.past, this.future);
  }

  redo() {
    this.#step(this.future, this.past);
  }

  /** @param {T[]} from @param {T[]} to */
  #step(from, to) {
    const next = from.pop();
    if (next === undefined) return;
    to.push(this.now);
    this.tag = null;
    this.#become(next);
  }

  /** @param {T} document */
  #become(document) {
    const before = this.now;
    this.now = document;
    this.dispatchEvent(new CustomEvent("change", { detail: { before } }));
  }
}
