// @ts-check
/** Two settings to switch between, the command that makes the picture, and settings as a file. */

import { commandOf, optionsOf, settingsOf } from "./command.js";
import { onChosen, save } from "./files.js";

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

/** @param {() => string} text @param {(text: string) => void} say */
async function copy(text, say) {
  try {
    await navigator.clipboard.writeText(text());
    say(`Copied: ${text()}`);
  } catch {
    // Without leave to write there, it can still be read.
    say(text());
  }
}

/**
 * @template {{options: Record<string, any>}} T
 * @param {import("./state.js").Store<T>} store
 * @param {import("./api.js").Option[]} declared
 * @param {() => {target: string, reference: string}} names
 * @param {(text: string) => void} say
 */
export function share(store, declared, names, say) {
  $("command").addEventListener("click", () =>
    copy(() => commandOf(store.now.options, declared, names(), $("format").value), say),
  );
  $("save-settings").addEventListener("click", () => save(settingsOf(store.now.options), "relit-settings.json"));
  onChosen($("load-settings"), async ([file]) => {
    const options = optionsOf(await file.text(), declared);
    if (!options) return say(`${file.name} is not a file of settings; choose one that was saved here.`);
    store.set(/** @type {Partial<T>} */ ({ options: { ...store.now.options, ...options } }));
    return say(`Settings of ${file.name}.`);
  });
  twoSettings(store, say);
}

/**
 * A and B: each keeps what was set while it was chosen.
 * @template {{options: Record<string, any>}} T
 * @param {import("./state.js").Store<T>} store @param {(text: string) => void} say
 */
function twoSettings(store, say) {
  /** @type {Record<string, Partial<T>>} */
  const kept = {};
  let chosen = "a";
  const show = () => {
    for (const slot of ["a", "b"]) $(`slot-${slot}`).setAttribute("aria-pressed", String(slot === chosen));
  };
  for (const slot of ["a", "b"]) {
    $(`slot-${slot}`).addEventListener("click", () => {
      if (slot === chosen) return;
      kept[chosen] = { ...store.now };
      chosen = slot;
      show();
      if (kept[slot]) store.set(kept[slot]);
      say(`Settings ${slot.toUpperCase()}.`);
    });
  }
  show();
}
