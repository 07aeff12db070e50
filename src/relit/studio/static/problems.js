// @ts-check
/** What went wrong: beside the photo that it befell, and on the stage, where it is seen. */

/** @typedef {import("./api.js").Role | "work"} Whose a photo's, or that of what is made of both */

export class Problems {
  /** @param {HTMLElement} stage @param {Record<import("./api.js").Role, import("./panel.js").Panel>} panels */
  constructor(stage, panels) {
    this.stage = stage;
    this.panels = panels;
    /** @type {Record<Whose, string>} */
    this.now = { target: "", reference: "", work: "" };
  }

  /** @param {Whose} whose @param {string} text empty where all is well */
  tell(whose, text) {
    this.now[whose] = text;
    if (whose !== "work") this.panels[whose].problem(text);
    const told = Object.values(this.now).filter(Boolean).join(" ");
    // An alert that is set anew is read out anew.
    if (this.stage.textContent !== told) this.stage.textContent = told;
  }
}
