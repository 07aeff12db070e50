// @ts-check
/** What the preview says: a picture, how long it took, or what is wrong with what was asked. */

import { ApiError } from "./api.js";

/**
 * @typedef {object} Page
 * @property {import("./looks.js").Looks} looks
 * @property {(text: string) => void} say
 * @property {() => string} said
 * @property {(text: string) => void} blame landmarks, in words; empty where nothing is wrong with them
 * @property {(picture: import("./preview.js").Picture) => void} came a picture
 */

/**
 * @param {import("./preview.js").Preview} preview @param {import("./stage.js").Stage} stage
 * @param {import("./controls.js").Controls} controls @param {import("./problems.js").Problems} problems @param {Page} page
 */
export function showing(preview, stage, controls, problems, page) {
  let took = 0;
  preview.addEventListener("busy", (event) => {
    const busy = /** @type {CustomEvent} */ (event).detail;
    stage.root.classList.toggle("busy", busy);
    if (busy) page.say("Relighting…");
    else if (page.said() === "Relighting…") page.say("");
  });
  preview.addEventListener("settled", (event) => {
    stage.root.setAttribute("aria-busy", String(!(/** @type {CustomEvent} */ (event).detail)));
  });
  preview.addEventListener("picture", (event) => {
    /** @type {import("./preview.js").Picture} */
    const picture = /** @type {CustomEvent} */ (event).detail;
    took = picture.seconds;
    controls.forgive();
    problems.tell("work", "");
    page.blame("");
    stage.show(picture);
    page.came(picture);
  });
  preview.addEventListener("done", () => {
    page.say(`Done in ${took.toFixed(2)} s.`);
    void page.looks.go();
  });
  preview.addEventListener("problem", (event) => {
    const error = /** @type {CustomEvent} */ (event).detail;
    if (!(error instanceof ApiError)) throw error;
    // A view that this method does not make: its result says whether anything else is wrong.
    if (stage.tab !== "result" && error.status !== 0 && error.code !== "busy") return stage.open("result");
    const marks = ["bad_landmarks", "no_face"].includes(error.code);
    const blamed = controls.blame(error.message);
    page.blame(!blamed && marks ? error.message : "");
    problems.tell("work", blamed || marks ? "" : error.message);
    page.say(error.message);
  });
}
