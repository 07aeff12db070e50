// @ts-check
/** Landmarks of two faces as pairs, row by row. Pure functions: marks come in, new marks go out. */

/**
 * @typedef {import("./api.js").Marks} Marks
 * @typedef {import("./api.js").Role} Role
 * @typedef {Record<Role, Marks | null>} Faces
 */

export const ROLES = /** @type {const} */ (["target", "reference"]);
export const LEAST = 3;

/** @param {Role} role @returns {Role} */
export const other = (role) => (role === "target" ? "reference" : "target");

/** @param {(number[] | null)[]} points @returns {Marks} */
function byHand(points) {
  return { scheme: "points", points, groups: { points: points.map((_, row) => row) }, detected: false };
}

/** Two faces without a point, to place pairs from nothing; a photo that is alone has none to pair. @param {boolean} alone @returns {Faces} */
export const nothing = (alone) => ({ target: byHand([]), reference: alone ? null : byHand([]) });

/** @param {Marks | null} marks */
export const placed = (marks) => (marks ? marks.points.filter(Boolean).length : 0);

/** Whether two faces can be laid on each other. @param {Faces} faces */
export function pairable({ target, reference }) {
  return (
    target !== null &&
    reference !== null &&
    target.scheme === reference.scheme &&
    target.points.length === reference.points.length
  );
}

/** The rows that have a name. @param {Marks} marks */
const named = ({ groups }) => [...new Set(Object.values(groups).flat())].sort((a, b) => a - b);

/**
 * Rows as hand-made points. A dense mesh brings only its named features: the rest of it follows from them.
 * @param {Faces} faces @param {boolean} alone
 * @returns {Faces}
 */
export function loosened(faces, alone) {
  const { target, reference } = faces;
  if (!target || (!alone && !pairable(faces))) return nothing(alone);
  if (target.scheme === "points") return faces;
  const rows = named(target);
  /** @param {Marks | null} marks */
  const chosen = (marks) => marks && byHand(rows.map((row) => marks.points[row]?.slice(0, 2) ?? null));
  return { target: chosen(target), reference: alone ? null : chosen(reference) };
}

/**
 * Move a point; a depth that is known stays.
 * @param {Faces} faces @param {Role} role @param {number} row @param {number[]} place
 * @returns {Faces}
 */
export function moved(faces, role, row, place) {
  const marks = faces[role];
  if (!marks) return faces;
  const points = marks.points.slice();
  points[row] = [...place, ...(points[row]?.slice(2) ?? [])];
  return { ...faces, [role]: { ...marks, points, detected: false } };
}

/**
 * Place a point: the partner of the first that still lacks one here, else the first of a new pair.
 * @param {Faces} faces @param {Role} role @param {number[]} place @param {boolean} alone whether there is no other photo
 * @returns {{faces: Faces, row: number}}
 */
export function added(faces, role, place, alone) {
  const loose = loosened(faces, alone);
  const here = loose[role]?.points.slice() ?? [];
  if (alone) return { faces: { ...loose, [role]: byHand([...here, place]) }, row: here.length };
  const there = loose[other(role)]?.points.slice() ?? [];
  let row = here.findIndex((point, k) => !point && there[k]);
  if (row < 0) {
    row = here.length;
    there.push(null);
  }
  here[row] = place;
  return { faces: /** @type {Faces} */ ({ [role]: byHand(here), [other(role)]: byHand(there) }), row };
}

/** Whether points can be deleted: of a photo that is alone, or of both that are paired. @param {Faces} faces @param {boolean} alone */
export const removable = (faces, alone) => (alone ? faces.target !== null : pairable(faces));

/**
 * Delete a pair, or a point of a photo that is alone.
 * @param {Faces} faces @param {number} row @param {boolean} alone
 * @returns {Faces}
 */
export function removed(faces, row, alone) {
  if (!faces.target || !removable(faces, alone)) return faces;
  const at = faces.target.scheme === "points" ? row : named(faces.target).indexOf(row);
  const loose = loosened(faces, alone);
  /** @param {Marks | null} one */
  const without = (one) => one && byHand(one.points.filter((_, k) => k !== at));
  return { target: without(loose.target), reference: without(loose.reference) };
}

/**
 * What the server is to hold: of hand-made points the pairs of which both are placed, and only once they
 * are enough.
 * @param {Faces} faces @param {Role} role
 * @returns {{scheme: string, points: number[][]} | null}
 */
export function toSend(faces, role) {
  const here = faces[role];
  const there = faces[other(role)];
  if (!here) return null;
  const whole =
    here.scheme === "points" && there?.scheme === "points"
      ? here.points.filter((point, row) => point && there.points[row])
      : here.points;
  if (whole.length < LEAST || whole.includes(null)) return null;
  return { scheme: here.scheme, points: /** @type {number[][]} */ (whole) };
}
