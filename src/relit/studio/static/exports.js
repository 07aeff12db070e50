// @ts-check
/** What leaves the page: the photo in full resolution, saved or copied, and the preview, dragged. */

import { save } from "./files.js";
import { copied } from "./outgoing.js";
import { first } from "./zip.js";

/**
 * @typedef {object} Page
 * @property {(act: () => Promise<void>, doing: string) => Promise<void>} attempt do what the server may refuse
 * @property {() => Promise<object>} request what is to be made, once the server knows what the page knows
 * @property {() => string} format of the file
 * @property {() => string} name of the target
 * @property {() => {width: number, height: number} | null} size of what can be made, if anything can
 * @property {(text: string) => void} say
 */

export class Exports {
  /**
   * @param {import("./api.js").Session} session @param {import("./viewer.js").Viewer} viewer
   * @param {HTMLButtonElement} button @param {HTMLElement} copying @param {Page} page
   */
  constructor(session, viewer, button, copying, page) {
    this.session = session;
    this.button = button;
    this.page = page;
    this.working = false;
    button.addEventListener("click", () => this.#save());
    copying.addEventListener("click", () => this.#copy());
    viewer.file = () => {
      const { src = "", naturalWidth, naturalHeight } = viewer.pictures.after ?? {};
      const name = (page.name() || "photo").replace(/\.[^.]*$/, "");
      return { url: src, name: `${name}-relit-${naturalWidth}x${naturalHeight}.jpg` };
    };
  }

  /** Whether there is anything to export. @param {boolean} yes */
  able(yes) {
    this.button.disabled = this.working || !yes;
  }

  async #save() {
    this.working = true;
    this.able(false);
    try {
      await this.page.attempt(async () => {
        const { file, lost } = await this.session.export({ ...(await this.page.request()), format: this.page.format() });
        save(file, "relit.zip");
        const told = lost.length ? ` This format does not keep ${lost.join(", ")}.` : "";
        this.page.say(`Exported relit.zip.${told}`);
      }, "Exporting in full resolution…");
    } finally {
      this.working = false;
      this.able(Boolean(this.page.size()));
    }
  }

  #copy() {
    const size = this.page.size();
    if (!size) return this.page.say("There is no picture yet.");
    return this.page.attempt(async () => {
      const png = this.page.request().then(async (request) => first((await this.session.export({ ...request, format: ".png" })).file));
      const refused = await copied(png);
      await png; // what the server refuses is its to tell
      this.page.say(refused || `Copied the picture, ${size.width} × ${size.height}.`);
    }, "Making it in full resolution…");
  }
}
