// @ts-check
/** The HTTP API, and nothing that knows of the page. */

const BASE = "/api/v1";
const MOST_ASKED = 6; // times, of a server that is busy
const LONGEST_PAUSE = 5; // s in between: who has to wait longer is told

let token = "";

/** Send a token with every request from now on; none if it is empty. @param {string} given */
export function useToken(given) {
  token = given;
}

/**
 * @typedef {"target" | "reference"} Role
 * @typedef {{scheme: string, points: (number[] | null)[], groups: Record<string, number[]>, detected: boolean}} Marks
 * @typedef {{width: number, height: number, landmarks: Marks | null, message: string | null, name: string | null}} Photo
 * @typedef {{name: string, flag: string, help: string, default: any, kind: string, choices: any[],
 *   title: string, group: string, words: string[], at_least: number | null, at_most: number | null, above: number | null}} Option
 * @typedef {{options: Option[], landmark_formats: string[], lights: import("./lamps.js").Known,
 *   limits: {bytes: number, pixels: number}}} Offer
 */

/** What the server refused, in its own words for the user. */
export class ApiError extends Error {
  /** @param {number} status @param {string} code @param {string} message */
  constructor(status, code, message) {
    super(message);
    this.status = status;
    this.code = code;
  }
}

/** @param {unknown} error */
export function isAborted(error) {
  return error instanceof DOMException && error.name === "AbortError";
}

/**
 * @param {string} path
 * @param {{method?: string, json?: unknown, body?: Blob, signal?: AbortSignal}} [request]
 */
async function ask(path, { method = "GET", json, body, signal } = {}) {
  /** @type {Record<string, string>} */
  const headers = {};
  /** @type {RequestInit} */
  const init = { method, signal, body, headers, cache: "no-store" };
  if (token) headers.Authorization = `Bearer ${token}`;
  if (json !== undefined) {
    headers["Content-Type"] = "application/json";
    init.body = JSON.stringify(json);
  }
  for (let asked = 1; ; asked++) {
    let response;
    try {
      response = await fetch(BASE + path, init);
    } catch (error) {
      if (isAborted(error)) throw error;
      throw new ApiError(0, "unreachable", "The studio does not answer. Is relit studio still running?");
    }
    if (response.ok) return response;
    const said = await response.json().catch(() => null);
    const code = said?.error?.code ?? "failed";
    const again = Number(response.headers.get("Retry-After"));
    if (code === "busy" && again <= LONGEST_PAUSE && asked < MOST_ASKED) {
      await pause(again, signal);
      continue;
    }
    const fallback = `The studio answered with ${response.status}. Try again, or reload the page.`;
    throw new ApiError(response.status, code, said?.error?.message ?? fallback);
  }
}

/** @param {number} seconds @param {AbortSignal} [signal] */
function pause(seconds, signal) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => {
      signal?.removeEventListener("abort", stop);
      resolve(undefined);
    }, 1000 * seconds);
    const stop = () => {
      clearTimeout(timer);
      reject(new DOMException("Nobody waits for it.", "AbortError"));
    };
    if (signal?.aborted) stop();
    else signal?.addEventListener("abort", stop, { once: true });
  });
}

/** @param {string} path @param {Parameters<typeof ask>[1]} [request] */
const askJson = async (path, request) => (await ask(path, request)).json();

/** @returns {Promise<Offer>} */
export const fetchOptions = () => askJson("/options");

/** One visitor's photos on the server. */
export class Session {
  /** @param {string} token */
  constructor(token) {
    this.token = token;
    /** @type {((fresh: Session) => Promise<boolean>) | null} fills a new one as this was; false: that cannot be */
    this.refill = null;
    /** @type {() => void} */
    this.renewed = () => {};
    /** @type {Promise<boolean> | null} */
    this.renewal = null;
  }

  /** @param {string} path @param {Parameters<typeof ask>[1]} [request] */
  async #ask(path, request) {
    const { token } = this;
    try {
      return await ask(`/sessions/${token}${path}`, request);
    } catch (error) {
      if (!(error instanceof ApiError && error.code === "not_found")) throw error;
      if (!(await this.#renewed(token))) {
        throw new ApiError(404, "not_found", "The studio has these photos no more; reload the page, and drop them again.");
      }
      return ask(`/sessions/${this.token}${path}`, request);
    }
  }

  /** @param {string} path @param {Parameters<typeof ask>[1]} [request] */
  async #json(path, request) {
    return (await this.#ask(path, request)).json();
  }

  /** Whether there is a new session in place of one that has ended. @param {string} ended */
  #renewed(ended) {
    if (ended !== this.token) return Promise.resolve(true); // another request has seen to it
    this.renewal ??= this.#renew().finally(() => (this.renewal = null));
    return this.renewal;
  }

  async #renew() {
    if (!this.refill) return false;
    const fresh = await Session.open();
    if (!(await this.refill(fresh))) return false;
    this.token = fresh.token;
    this.renewed();
    return true;
  }

  static async open() {
    return new Session((await askJson("/sessions", { method: "POST" })).session);
  }

  /** @returns {Promise<Record<Role, Photo | null>>} */
  about() {
    return this.#json("");
  }

  /** @returns {Promise<Record<Role, Photo>>} */
  samples() {
    return this.#json("/samples", { method: "POST" });
  }

  /** The target becomes a reference at hand, of the name `id`. @returns {Promise<Record<Role, Photo> & {id: string}>} */
  swap() {
    return this.#json("/swap", { method: "POST" });
  }

  /** @param {Role} role @param {Blob} file @param {AbortSignal} [signal] @returns {Promise<Photo>} */
  upload(role, file, signal) {
    return this.#json(`/photos/${role}`, { method: "PUT", body: file, signal });
  }

  /** @param {Role} role @param {number} side */
  async picture(role, side) {
    return (await this.#ask(`/photos/${role}?side=${side}`)).blob();
  }

  /** @param {Role} role @returns {Promise<Marks>} */
  landmarks(role) {
    return this.#json(`/landmarks/${role}`);
  }

  /** @param {Role} role @param {{scheme: string, points: number[][]}} marks @returns {Promise<Marks>} */
  place(role, marks) {
    return this.#json(`/landmarks/${role}`, { method: "PUT", json: marks });
  }

  /** @param {Role} role @returns {Promise<Marks>} */
  detect(role) {
    return this.#json(`/landmarks/${role}/detect`, { method: "POST" });
  }

  /** The part of the target's face at a place, in px of the photo. @param {number[]} place @returns {Promise<{part: string | null}>} */
  part([x, y]) {
    return this.#json(`/part?x=${Math.max(x, 0)}&y=${Math.max(y, 0)}`);
  }

  /** @param {Role} role @param {string} format */
  async saveLandmarks(role, format) {
    return (await this.#ask(`/landmarks/${role}/file?format=${format}`)).blob();
  }

  /** @param {Role} role @param {string} format @param {Blob} file @returns {Promise<Marks>} */
  loadLandmarks(role, format, file) {
    return this.#json(`/landmarks/${role}/file?format=${format}`, { method: "PUT", body: file });
  }

  /** @param {unknown} request @param {AbortSignal} [signal] */
  render(request, signal) {
    return this.#ask("/render", { method: "POST", json: request, signal });
  }

  /** @param {unknown} request @param {AbortSignal} [signal] */
  async export(request, signal) {
    const answer = await this.#ask("/export", { method: "POST", json: request, signal });
    return { file: await answer.blob(), lost: JSON.parse(answer.headers.get("X-Relit-Not-Kept") ?? "[]") };
  }

  /** The references that were dropped so far. @returns {Promise<Record<string, Photo>>} */
  references() {
    return this.#json("/references");
  }

  /** @param {string} id @param {Blob} file @param {AbortSignal} [signal] @returns {Promise<Photo>} */
  addReference(id, file, signal) {
    return this.#json(`/references/${id}`, { method: "PUT", body: file, signal });
  }

  /** @param {string} id @param {{scheme: string, points: number[][]}} marks @returns {Promise<Marks>} */
  placeReference(id, marks) {
    return this.#json(`/references/${id}/landmarks`, { method: "PUT", json: marks });
  }

  /** @param {string} id @param {AbortSignal} [signal] @returns {Promise<Record<Role, Photo | null>>} */
  chooseReference(id, signal) {
    return this.#json(`/references/${id}/choose`, { method: "POST", signal });
  }

  /** @param {string} id */
  removeReference(id) {
    return this.#ask(`/references/${id}`, { method: "DELETE" });
  }

  end() {
    return this.#ask("", { method: "DELETE" });
  }
}
