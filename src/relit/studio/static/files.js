// @ts-check
/** Files in and out of the page. */

/**
 * Take files that are dropped on an element or chosen by an input.
 * @param {HTMLElement} zone @param {HTMLInputElement} input @param {(file: File) => void} take
 */
export function takeFiles(zone, input, take) {
  zone.addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    zone.classList.add("dropping");
  });
  zone.addEventListener("dragleave", (event) => {
    if (!zone.contains(/** @type {Node | null} */ (event.relatedTarget))) zone.classList.remove("dropping");
  });
  zone.addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("dropping");
    const file = event.dataTransfer?.files[0];
    if (file) take(file);
  });
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    // So that the same file can be chosen again.
    if (file) take(file);
    input.value = "";
  });
}

/** A file that misses its zone must not replace the page. */
export function guardPage() {
  for (const type of ["dragover", "drop"]) window.addEventListener(type, (event) => event.preventDefault());
}

/** @param {Blob} blob @param {string} name */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The format that a file's name says, of those that are known. @param {string} name @param {string[]} formats */
export function formatOf(name, formats) {
  const lower = name.toLowerCase();
  return formats.find((format) => lower.endsWith(format)) ?? null;
}
