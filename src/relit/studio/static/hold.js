// @ts-check
/** Something that lasts as long as a key or a button is held. */

const TYPING = "textarea, select, input:not([type=range], [type=checkbox], [type=radio], [type=color])";

/** Whether a letter or a digit is meant for what has the focus. @param {EventTarget | null} target */
export const typed = (target) => Boolean(/** @type {Element} */ (target)?.closest?.(TYPING));

/**
 * @param {HTMLElement} button @param {string[]} keys that do the same wherever the focus is, but where one types
 * @param {(held: boolean) => void} act
 */
export function holding(button, keys, act) {
  const hold = (/** @type {boolean} */ held) => {
    button.setAttribute("aria-pressed", String(held));
    act(held);
  };
  const means = (/** @type {KeyboardEvent} */ { key, target, ctrlKey, metaKey, altKey }) => {
    if (ctrlKey || metaKey || altKey) return false;
    if (target === button && [" ", "Enter"].includes(key)) return true;
    return keys.includes(key.toLowerCase()) && !typed(target);
  };
  window.addEventListener("keydown", (event) => {
    if (!means(event)) return;
    event.preventDefault();
    hold(true);
  });
  button.addEventListener("pointerdown", () => hold(true));
  // It may be let go anywhere, or in another window.
  for (const type of ["keyup", "blur", "pointerup", "pointercancel"]) window.addEventListener(type, () => hold(false));
}
