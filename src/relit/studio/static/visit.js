// @ts-check
/** Which session a visit belongs to: that of the address, that of before a reload, or a new one. */

import { ApiError, Session } from "./api.js";

const KEPT = "relit"; // key of what outlives a reload

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {{session: string, names: Record<Role, string>, options: Record<string, any>, reference: string,
 *   references: Record<string, string>, starred: string[]}} Kept
 */

/** @returns {Promise<{session: Session, photos: Record<Role, import("./api.js").Photo | null>, kept: Kept | null}>} */
export async function begin() {
  const asked = location.hash.slice(1);
  // The token opens the photos: it is not to be copied with the address.
  if (asked) history.replaceState(null, "", location.pathname);
  /** @type {Kept | null} */
  const stored = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
  const token = asked || stored?.session;
  if (token) {
    const session = new Session(token);
    try {
      return { session, photos: await session.about(), kept: stored?.session === token ? stored : null };
    } catch (error) {
      // One that has run out makes way for a new one.
      if (!(error instanceof ApiError && error.status === 404)) throw error;
    }
  }
  return { session: await Session.open(), photos: { target: null, reference: null }, kept: null };
}

/** @param {Kept} kept */
export const keep = (kept) => sessionStorage.setItem(KEPT, JSON.stringify(kept));
