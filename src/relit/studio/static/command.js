// @ts-check
/** The command that makes what the page shows, and settings as a file that it and the page read. */

/**
 * @param {Record<string, any>} options @param {import("./api.js").Option[]} declared
 * @param {{target: string, reference: string}} names @param {string} format
 */
export function commandOf(options, declared, names, format) {
  const words = ["relit", "transfer", quoted(names.target || "TARGET")];
  if (!options.light) words.push(quoted(names.reference || "REFERENCE"));
  for (const { name, flag, default: standard } of declared) {
    const value = options[name];
    if (value === standard || value === null || value === undefined) continue;
    if (typeof value === "boolean") words.push(value ? flag : flag.replace(/^--/, "--no-"));
    else words.push(`${flag}=${quoted(String(value))}`); // a value may begin with a minus
  }
  const stem = (names.target || "photo").replace(/\.[^.]*$/, "");
  return [...words, "-o", quoted(`${stem}-relit${format}`)].join(" ");
}

/** A word as a POSIX shell takes it. @param {string} word */
const quoted = (word) => (/^[\w.,:=+/@%-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** @param {Record<string, any>} options */
export const settingsOf = (options) =>
  new Blob([`${JSON.stringify({ options }, null, 1)}\n`], { type: "application/json" });

/**
 * The options of a settings file, those that are known here.
 * @param {string} text @param {import("./api.js").Option[]} declared
 * @returns {Record<string, any> | null} null of what is no such file
 */
export function optionsOf(text, declared) {
  let given;
  try {
    given = JSON.parse(text)?.options;
  } catch {
    return null;
  }
  if (given === null || typeof given !== "object") return null;
  return Object.fromEntries(declared.filter(({ name }) => name in given).map(({ name }) => [name, given[name]]));
}
