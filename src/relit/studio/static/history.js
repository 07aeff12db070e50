// @ts-check
/** Undo and redo, by buttons and by the keys that all programs have for them. */

/** @param {import("./state.js").Store<any>} store @param {HTMLButtonElement} undo @param {HTMLButtonElement} redo */
export function undoing(store, undo, redo) {
  undo.addEventListener("click", () => store.undo());
  redo.addEventListener("click", () => store.redo());
  store.addEventListener("change", () => {
    undo.disabled = !store.past.length;
    redo.disabled = !store.future.length;
  });
  window.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && ["text", "number"].includes(event.target.type);
    if (!(event.ctrlKey || event.metaKey) || typing || !["z", "y"].includes(event.key.toLowerCase())) return;
    event.preventDefault();
    if (event.shiftKey || event.key.toLowerCase() === "y") store.redo();
    else store.undo();
  });
}
