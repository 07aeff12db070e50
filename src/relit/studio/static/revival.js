// @ts-check
/** A session that the server has forgotten, filled anew with what the page still has. */

import { ROLES, toSend } from "./pairs.js";

/** @typedef {Record<import("./api.js").Role, File | null>} Files */

/**
 * @param {import("./api.js").Session} fresh
 * @param {Files} files of the photos in use
 * @param {import("./gallery.js").Gallery} gallery
 * @param {import("./main.js").Document} document
 * @returns {Promise<boolean>} whether it holds all that is in use
 */
export async function refill(fresh, files, gallery, { faces, options }) {
  if (!files.target || !(files.reference || options.light)) return false;
  await fresh.upload("target", files.target);
  for (const [id, file] of gallery.files) await fresh.addReference(id, file);
  if (gallery.files.has(gallery.inUse)) await fresh.chooseReference(gallery.inUse);
  else if (files.reference) await fresh.upload("reference", files.reference);
  for (const role of ROLES) {
    const marks = files[role] && toSend(faces, role);
    if (marks) await fresh.place(role, marks);
  }
  gallery.names = Object.fromEntries(Object.entries(gallery.names).filter(([id]) => gallery.files.has(id)));
  gallery.show();
  return true;
}
