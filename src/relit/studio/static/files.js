// @ts-check
/** Files in and out of the page. */

/**
 * Take files that are dropped on an element, unless one inside it has taken them.
 * @param {HTMLElement} zone @param {(files: File[]) => void} take
 */
export function dropZone(zone, take) {
  const hasFiles = (/** @type {DragEvent} */ event) => Boolean(event.dataTransfer?.types.includes("Files"));
  zone.addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    zone.classList.toggle("dropping", !event.defaultPrevented);
    event.preventDefault();
  });
  zone.addEventListener("dragleave", (event) => {
    if (!zone.contains(/** @type {Node | null} */ (event.relatedTarget))) zone.classList.remove("dropping");
  });
  zone.addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    zone.classList.remove("dropping");
    if (!event.defaultPrevented) take([...(event.dataTransfer?.files ?? [])]);
    // A file must not replace the page.
    event.preventDefault();
  });
}

/** @param {HTMLInputElement} input @param {(files: File[]) => void} take */
export function onChosen(input, take) {
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    // So that the same file can be chosen again.
    input.value = "";
    if (files.length) take(files);
  });
}

/** Whether a file can be read: a folder that was dropped cannot. @param {File} file */
export async function readable(file) {
  try {
    await file.slice(0, 1).arrayBuffer();
    return true;
  } catch {
    return false;
  }
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
