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

/** Two faces without a point, to place pairs from nothing. @returns {Faces} */
export const nothing = () => ({ target: byHand([]), reference: byHand([]) });

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

/**
 * Rows as hand-made points. A dense mesh brings only its named features: the rest of it follows from them.
 * @param {Faces} faces
 * @returns {Faces}
 */
export function loosened(faces) {
  if (!pairable(faces)) return nothing();
  const { target, reference } = /** @type {Record<Role, Marks>} */ (faces);
  if (target.scheme === "points") return faces;
  const rows = [...new Set(Object.values(target.groups).flat())].sort((a, b) => a - b);
  /** @param {Marks} marks */
  const chosen = (marks) => byHand(rows.map((row) => marks.points[row]?.slice(0, 2) ?? null));
  return { target: chosen(target), reference: chosen(reference) };
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
 * @param {Faces} faces @param {Role} role @param {number[]} place
 * @returns {{faces: Faces, row: number}}
 */
export function added(faces, role, place) {
  const loose = /** @type {Record<Role, Marks>} */ (loosened(faces));
  const here = loose[role].points.slice();
  const there = loose[other(role)].points.slice();
  let row = here.findIndex((point, k) => !point && there[k]);
  if (row < 0) {
    row = here.length;
    there.push(null);
  }
  here[row] = place;
  return { faces: /** @type {Faces} */ ({ [role]: byHand(here), [other(role)]: byHand(there) }), row };
}

/**
 * Delete a pair.
 * @param {Faces} faces @param {number} row
 * @returns {Faces}
 */
export function removed(faces, row) {
  if (!pairable(faces)) return faces;
  const marks = /** @type {Record<Role, Marks>} */ (faces);
  const rows = [...new Set(Object.values(marks.target.groups).flat())].sort((a, b) => a - b);
  const at = marks.target.scheme === "points" ? row : rows.indexOf(row);
  const loose = /** @type {Record<Role, Marks>} */ (loosened(faces));
  /** @param {Marks} one */
  const without = (one) => byHand(one.points.filter((_, k) => k !== at));
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
