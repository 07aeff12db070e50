// @ts-check
/** Two settings to switch between, the command that makes the picture, and settings as a file. */

import { ApiError } from "./api.js";
import { SETTINGS, commandOf, faultOf, optionsOf, settingsOf } from "./command.js";
import { save } from "./files.js";

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

/** @param {string} text @param {(text: string) => void} say @param {string} more to know about it */
async function copy(text, say, more) {
  try {
    await navigator.clipboard.writeText(text);
    say(`Copied: ${text}${more}`);
  } catch {
    // Without leave to write there, it can still be read.
    say(`${text}${more}`);
  }
}

/**
 * @template {{options: Record<string, any>, reference: string, faces: import("./pairs.js").Faces, slot: string}} T
 * @param {import("./state.js").Store<T>} store
 * @param {import("./api.js").Option[]} declared
 * @param {() => {target: string, reference: string}} names
 * @param {(reference: string) => boolean} held whether a reference can be had again
 * @param {(text: string) => void} say
 * @returns {(file: File) => Promise<void>} what loads settings, or says why not
 */
export function share(store, declared, names, held, say) {
  $("command").addEventListener("click", () => {
    const { options, faces } = store.now;
    const used = options.light ? [faces.target] : [faces.target, faces.reference];
    const byHand = used.some((marks) => marks && !marks.detected);
    const more = byHand ? ` (the export has ${SETTINGS}, with the landmarks that were placed)` : "";
    return copy(commandOf(options, declared, names(), $("format").value, byHand), say, more);
  });
  $("save-settings").addEventListener("click", () => save(settingsOf(store.now.options), "relit-settings.json"));
  /** @param {File} file */
  const load = async (file) => {
    const options = await optionsOf(file);
    if (!options) throw new ApiError(0, "refused", `${file.name} is not a file of settings; choose one that was saved here.`);
    const fault = faultOf(options, declared);
    if (fault) throw new ApiError(0, "refused", `${file.name}: ${fault}`);
    store.set(/** @type {Partial<T>} */ ({ options: { ...store.now.options, ...options } }));
    say(`Settings of ${file.name}.`);
  };
  twoSettings(store, held, say);
  return load;
}

/**
 * A and B: each keeps what was set while it was chosen, and not the photo that it is looked at on.
 * @template {{options: Record<string, any>, reference: string, faces: import("./pairs.js").Faces, slot: string}} T
 * @param {import("./state.js").Store<T>} store @param {(reference: string) => boolean} held
 * @param {(text: string) => void} say
 */
function twoSettings(store, held, say) {
  /** @type {Record<string, T>} */
  const kept = {};
  const slots = ["a", "b"];
  const show = () => {
    // Which one it is can be undone as well: what is undone is always that of the one that is lit.
    kept[store.now.slot] = store.now;
    for (const slot of slots) $(`slot-${slot}`).setAttribute("aria-pressed", String(slot === store.now.slot));
  };
  for (const slot of slots) {
    $(`slot-${slot}`).addEventListener("click", () => {
      if (slot === store.now.slot) return;
      store.set(/** @type {Partial<T>} */ ({ slot, ...ofSlot(store.now, kept[slot] ?? store.now, held) }));
      say(`Settings ${slot.toUpperCase()}.`);
    });
  }
  store.addEventListener("change", show);
  show();
}

/**
 * What of other settings goes over: a reference with its landmarks if it can be had again, and never the target.
 * @template {{options: Record<string, any>, reference: string, faces: import("./pairs.js").Faces}} T
 * @param {T} now @param {T} other @param {(reference: string) => boolean} held
 */
function ofSlot(now, other, held) {
  const { options, reference, faces } = other;
  if (!held(reference) || reference === now.reference) return { options };
  return { options, reference, faces: { ...now.faces, reference: faces.reference } };
}
