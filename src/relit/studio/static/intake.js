// @ts-check
/** Files that are dropped or chosen, on their way to the server: photos, and by their names landmarks. */

import { ApiError } from "./api.js";
import { formatOf, readable } from "./files.js";
import { Newest } from "./newest.js";
import { ROLES } from "./pairs.js";

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {import("./api.js").Photo} Photo
 * @typedef {import("./api.js").Marks} Marks
 * @typedef {{target?: Photo, reference?: string}} Given a target, and by what a reference is at hand
 */

export class Intake {
  /**
   * @param {import("./api.js").Session} session
   * @param {import("./sync.js").Sync} sync
   * @param {import("./api.js").Offer} offer
   * @param {(role: Role | null, act: () => Promise<void>) => Promise<void>} attempt
   * @param {import("./lighting.js").Lighting} lighting
   * @param {{photos: (given: Given, files: Partial<Record<Role, File>>) => Promise<void>,
   *   marks: (role: Role, marks: Marks) => void}} taken told what the server has taken, in the order in which it has
   */
  constructor(session, sync, { limits, landmark_formats: formats }, attempt, lighting, taken) {
    this.session = session;
    this.sync = sync;
    this.limits = limits;
    this.formats = formats;
    this.attempt = attempt;
    this.lighting = lighting;
    this.taken = taken;
    this.target = new Newest();
    /** @type {Promise<void>} */
    this.taking = Promise.resolve();
  }

  /** @param {File[]} files @param {Role} role whose one file is */
  async receive(files, role) {
    await this.#photos(dealt(files.filter((file) => !this.isMarks(file)), role));
    const marks = dealt(files.filter((file) => this.isMarks(file)), role);
    for (const one of ROLES) if (marks[one]) await this.marks(one, marks[one]);
  }

  /** Whether a file is of landmarks, by its name. @param {File} file */
  isMarks(file) {
    return formatOf(file.name, this.formats) !== null;
  }

  /** @param {Role} role @param {File} file */
  marks(role, file) {
    return this.#of(role, file, async () => {
      const format = formatOf(file.name, this.formats);
      if (!format) throw refusal(`not a landmark file; choose one of ${this.formats.join(", ")}.`);
      await this.#check(file);
      this.taken.marks(role, await this.session.loadLandmarks(role, format, file));
    });
  }

  /** @param {Partial<Record<Role, File>>} files */
  #photos({ target, reference }) {
    /** @type {Given} */
    const given = {};
    // One that comes late does not push out a newer target; of references, it only joins the others.
    const signal = target && this.target.next();
    const wish = reference && this.lighting.newest.next();
    const upload = (/** @type {Role} */ role, /** @type {File} */ file) =>
      this.#of(role, file, async () => {
        await this.#check(file);
        if (role === "reference") given.reference = await this.lighting.gallery.add(file);
        else given.target = await this.session.upload(role, file, signal);
      });
    const act = async () => {
      await Promise.all([target && upload("target", target), reference && upload("reference", reference)]);
      if (wish?.aborted) delete given.reference;
      if (!given.target) return given.reference && this.taken.photos(given, { reference });
      this.taking = this.taking.then(() => this.attempt(null, () => this.taken.photos(given, { target, reference })));
      return this.taking;
    };
    return target ? this.sync.exchange(["target"], act) : act();
  }

  /** Do with a file what may be refused, and name it then. @param {Role} role @param {File} file @param {() => Promise<void>} act */
  #of(role, file, act) {
    return this.attempt(role, () =>
      act().catch((error) => {
        throw error instanceof ApiError ? new ApiError(error.status, error.code, `${file.name}: ${error.message}`) : error;
      }),
    );
  }

  /** @param {File} file */
  async #check(file) {
    const mega = (/** @type {number} */ bytes) => Math.round(bytes / 2 ** 20);
    if (file.size > this.limits.bytes) {
      throw refusal(`it has ${mega(file.size)} MB; at most ${mega(this.limits.bytes)} are taken. Choose a smaller file.`);
    }
    if (!(await readable(file))) throw refusal("it cannot be read; choose a file, not a folder.");
  }
}

/** @param {string} message */
const refusal = (message) => new ApiError(0, "refused", message);

/**
 * Whose files these are: one is that of the role, the first of two the target's and the second the reference's.
 * @param {File[]} files @param {Role} role
 * @returns {Partial<Record<Role, File>>}
 */
function dealt(files, role) {
  if (files.length < 2) return { [role]: files[0] };
  return { target: files[0], reference: files[1] };
}
