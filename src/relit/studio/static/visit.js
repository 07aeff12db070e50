// @ts-check
/** Which session a visit belongs to: that of the address, that of before a reload, or a new one. */

import { ApiError, Session } from "./api.js";

const KEPT = "relit"; // key of what outlives a reload
const PATIENCE = 1000; // ms in which a page that is loaded again lets go of its session

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {{session: string, names: Record<Role, string>, options: Record<string, any>, reference: string,
 *   references: Record<string, string>, starred: string[]}} Kept
 * @typedef {{session: Session, photos: Record<Role, import("./api.js").Photo | null>, kept: Kept | null, told: string}} Visit
 *   and what there is to tell of it
 */

/** @returns {Promise<Visit>} */
export async function begin() {
  const asked = location.hash.slice(1);
  // The token opens the photos: it is not to be copied with the address.
  if (asked) history.replaceState(null, "", location.pathname);
  /** @type {Kept | null} */
  const stored = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
  const token = asked || stored?.session;
  let told = "";
  if (token && !(await hold(token))) {
    told = "Those photos are open in another tab; this one begins with none.";
  } else if (token) {
    const session = new Session(token);
    try {
      return { session, photos: await session.about(), kept: stored?.session === token ? stored : null, told };
    } catch (error) {
      // One that has run out makes way for a new one.
      if (!(error instanceof ApiError && error.status === 404)) throw error;
      told = "The studio has the photos no more; drop them again.";
    }
  }
  const session = await Session.open();
  await hold(session.token);
  // Settings outlive the photos.
  const kept = stored && { ...stored, names: { target: "", reference: "" }, reference: "", references: {} };
  return { session, photos: { target: null, reference: null }, kept, told };
}

/**
 * Have a session for this page alone, for as long as it is open: a tab that was duplicated knows of the same one.
 * @param {string} token @returns {Promise<boolean>} whether no other page has it
 */
export function hold(token) {
  // None where the page came over plain HTTP from another machine.
  if (!navigator.locks) return Promise.resolve(true);
  return new Promise((tell, fail) => {
    const held = () => (tell(true), new Promise(() => {}));
    navigator.locks.request(`relit ${token}`, { signal: AbortSignal.timeout(PATIENCE) }, held).catch((error) => {
      if (error.name === "TimeoutError" || error.name === "AbortError") tell(false);
      else fail(error);
    });
  });
}

/** @param {Kept} kept */
export const keep = (kept) => sessionStorage.setItem(KEPT, JSON.stringify(kept));
