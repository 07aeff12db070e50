// @ts-check
/** Several files in one, stored as they are: photos are packed already. By PKWARE's APPNOTE 6.3. */

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit += 1) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

/** @param {Uint8Array} bytes */
function crc32(bytes) {
  let value = ~0;
  for (const byte of bytes) value = TABLE[(value ^ byte) & 0xff] ^ (value >>> 8);
  return ~value >>> 0;
}

/**
 * @param {{name: string, blob: Blob}[]} files
 * @returns {Promise<Blob>}
 */
export async function zipped(files) {
  /** @type {BlobPart[]} */
  const parts = [];
  /** @type {Uint8Array<ArrayBuffer>[]} */
  const directory = [];
  let offset = 0;
  for (const { name, blob } of files) {
    const title = new TextEncoder().encode(name);
    const crc = crc32(new Uint8Array(await blob.arrayBuffer()));
    // Version 2.0, names in UTF-8, stored, no time; checksum, sizes, lengths of the name and of nothing more.
    const common = [2, 20, 2, 0x800, 2, 0, 2, 0, 2, 0x21, 4, crc, 4, blob.size, 4, blob.size, 2, title.length, 2, 0];
    const head = packed([4, 0x04034b50, ...common], title);
    directory.push(packed([4, 0x02014b50, 2, 20, ...common, 2, 0, 2, 0, 2, 0, 4, 0, 4, offset], title));
    parts.push(head, blob);
    offset += head.length + blob.size;
  }
  const size = directory.reduce((sum, one) => sum + one.length, 0);
  const end = packed([4, 0x06054b50, 2, 0, 2, 0, 2, files.length, 2, files.length, 4, size, 4, offset, 2, 0]);
  return new Blob([...parts, ...directory, end], { type: "application/zip" });
}

/**
 * Numbers of so many bytes each, the lowest first, and what follows.
 * @param {number[]} numbers size, value, size, value, ... @param {Uint8Array} [more]
 * @returns {Uint8Array<ArrayBuffer>}
 */
function packed(numbers, more = new Uint8Array()) {
  const bytes = [];
  for (let k = 0; k < numbers.length; k += 2) {
    for (let byte = 0; byte < numbers[k]; byte += 1) bytes.push(Math.floor(numbers[k + 1] / 256 ** byte) & 0xff);
  }
  return new Uint8Array([...bytes, ...more]);
}

/** The first file of a ZIP file that compresses nothing and says sizes first, as the server's do. @param {Blob} zip */
export async function first(zip) {
  const head = new DataView(await zip.slice(0, 30).arrayBuffer());
  const start = 30 + head.getUint16(26, true) + head.getUint16(28, true);
  return zip.slice(start, start + head.getUint32(18, true), "image/png");
}
