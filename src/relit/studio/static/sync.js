// @ts-check
/** Landmarks on their way to the server: one at a time, always the newest. */

import { ROLES, toSend } from "./pairs.js";

/** @typedef {import("./pairs.js").Faces} Faces */

export class Sync {
  /** @param {import("./api.js").Session} session */
  constructor(session) {
    this.session = session;
    /** @type {Record<string, string | null>} what the server holds */
    this.held = { target: null, reference: null };
    /** @type {Promise<void>} */
    this.queue = Promise.resolve();
  }

  /** The server's own word on a face. @param {import("./api.js").Role} role @param {Faces} faces */
  knows(role, faces) {
    this.held[role] = JSON.stringify(toSend(faces, role));
  }

  /** Send what differs. @param {() => Faces} current @returns {Promise<void>} */
  push(current) {
    const next = this.queue.then(async () => {
      const faces = current();
      for (const role of ROLES) {
        const marks = toSend(faces, role);
        const text = JSON.stringify(marks);
        if (!marks || text === this.held[role]) continue;
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
