// @ts-check
/** Landmarks on their way to the server: one at a time, always the newest. */

import { ROLES, toSend } from "./pairs.js";

/**
 * @typedef {import("./pairs.js").Faces} Faces
 * @typedef {import("./api.js").Role} Role
 */

export class Sync {
  /** @param {import("./api.js").Session} session @param {() => void} resume what waited for a photo that stays, after all */
  constructor(session, resume) {
    this.session = session;
    this.resume = resume;
    this.waiting = false;
    /** @type {Record<string, string | null>} what the server holds */
    this.held = { target: null, reference: null };
    this.leaving = { target: 0, reference: 0 };
    /** @type {Promise<void>} */
    this.queue = Promise.resolve();
  }

  /** The server's own word on a face. @param {Role} role @param {Faces} faces */
  knows(role, faces) {
    this.held[role] = JSON.stringify(toSend(faces, role));
  }

  /**
   * Exchange photos: from before the server is asked until the page has its landmarks, none are sent, since nobody
   * knows which photo they would come to.
   * @template T @param {readonly Role[]} roles @param {() => Promise<T>} act @returns {Promise<T>}
   */
  async exchange(roles, act) {
    for (const role of roles) this.leaving[role] += 1;
    try {
      await this.queue;
      return await act();
    } finally {
      for (const role of roles) this.leaving[role] -= 1;
      if (this.waiting) this.resume();
    }
  }

  /** Send what differs. @param {() => Faces} current @returns {Promise<void>} */
  push(current) {
    const next = this.queue.then(async () => {
      this.waiting = false;
      for (const role of ROLES) {
        const marks = toSend(current(), role);
        const text = JSON.stringify(marks);
        if (!marks || text === this.held[role]) continue;
        if (this.leaving[role]) {
          this.waiting = true;
          continue;
        }
        try {
          await this.session.place(role, marks);
          this.held[role] = text;
        } catch (error) {
          this.held[role] = null;
          throw Object.assign(/** @type {Error} */ (error), { role });
        }
      }
    });
    this.queue = next.catch(() => {});
    return next;
  }
}
