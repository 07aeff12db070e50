// @ts-check
/** A picture on its way out of the page: dragged as a file, or copied. */

/** @typedef {{url: string, name: string}} Outgoing */

/** @type {Record<string, string>} */
const TYPES = { jpg: "image/jpeg", png: "image/png", tif: "image/tiff" };

/** Let a drag carry a file. @param {DragEvent} event @param {Outgoing} file */
export function carry({ dataTransfer }, { url, name }) {
  if (!dataTransfer) return;
  const address = new URL(url, location.href).href;
  const type = TYPES[name.split(".").at(-1) ?? ""] ?? "application/octet-stream";
  // Chromium makes a file of the first; other browsers and programs take the second.
  dataTransfer.setData("DownloadURL", `${type}:${name}:${address}`);
  dataTransfer.setData("text/uri-list", address);
  dataTransfer.effectAllowed = "copy";
}

/** A picture as PNG. @param {HTMLImageElement} picture @returns {Promise<Blob>} */
export function asPng(picture) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
  canvas.getContext("2d")?.drawImage(picture, 0, 0);
  return new Promise((go, fail) => canvas.toBlob((blob) => (blob ? go(blob) : fail(new Error("no PNG"))), "image/png"));
}

/** Copy a picture that is a PNG, and return what went wrong, if anything did. @param {Promise<Blob>} png */
export async function copied(png) {
  try {
    // The promise goes in as it is: Safari lets a page copy only at once after a click.
    await navigator.clipboard.write([new ClipboardItem({ "image/png": png })]);
    return "";
  } catch {
    return "The browser did not let this page copy the picture.";
  }
}
