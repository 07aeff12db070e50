// @ts-check
/** Wishes of which the newest counts: each calls off the one before. */

export class Newest {
  constructor() {
    this.wish = new AbortController();
  }

  /** @returns {AbortSignal} aborted once there is a newer wish */
  next() {
    this.wish.abort();
    this.wish = new AbortController();
    return this.wish.signal;
  }
}
