// @ts-check
/** The command that makes what the page shows, and settings as a file that it and the page read. */

/** Endings of files that the server makes, where they are others than the format's. @type {Record<string, string>} */
const ENDINGS = { ".exr": ".layers.exr" };

/** What the export holds besides the picture: options, and landmarks that no option can tell. */
export const SETTINGS = "settings.json";

/**
 * @param {Record<string, any>} options @param {import("./api.js").Option[]} declared
 * @param {{target: string, reference: string}} names @param {string} format
 * @param {boolean} byHand whether landmarks were placed
 */
export function commandOf(options, declared, names, format, byHand) {
  const words = ["relit", "transfer", filed(names.target || "TARGET")];
  if (!options.light) words.push(filed(names.reference || "REFERENCE"));
  if (byHand) words.push("--config", SETTINGS);
  for (const { name, flag, default: standard } of byHand ? [] : declared) {
    const value = options[name];
    if (value === standard || value === null || value === undefined) continue;
    if (typeof value === "boolean") words.push(value ? flag : flag.replace(/^--/, "--no-"));
    else words.push(`${flag}=${quoted(String(value))}`); // a value may begin with a minus
  }
  const stem = (names.target || "photo").replace(/\.[^.]*$/, "");
  return [...words, "-o", filed(`${stem}-relit${ENDINGS[format] ?? format}`)].join(" ");
}

/** A word as a POSIX shell takes it. @param {string} word */
const quoted = (word) => (/^[\w.,:=+/@%-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** The name of a file, which is not to be taken for an option. @param {string} name */
const filed = (name) => quoted(name.replace(/^-/, "./-"));

/** @param {Record<string, any>} options */
export const settingsOf = (options) =>
  new Blob([`${JSON.stringify({ options }, null, 1)}\n`], { type: "application/json" });

/** The options of a settings file, as it says them; null of what is no such file. @param {File} file */
export async function optionsOf(file) {
  try {
    const { options } = JSON.parse(await file.text());
    return typeof options === "object" && !Array.isArray(options) ? options : null;
  } catch {
    return null;
  }
}

/**
 * What is wrong with options, if anything is: the first that is not known, or not of the kind that is declared.
 * @param {Record<string, any>} options @param {import("./api.js").Option[]} declared
 */
export function faultOf(options, declared) {
  for (const [name, value] of Object.entries(options)) {
    const option = declared.find((one) => one.name === name);
    if (!option) return `${name} is no option of this studio; correct the name, or take it out.`;
    if (!fits(option, value)) return `${name}: expected ${expected(option)}, got ${JSON.stringify(value)}.`;
  }
  return "";
}

/** @param {import("./api.js").Option} option @param {any} value */
function fits({ kind, choices, words, default: standard, at_least, at_most, above }, value) {
  if (value === null) return standard === null;
  if (kind === "choice") return choices.includes(value);
  if (kind === "switch") return typeof value === "boolean";
  if (kind === "text") return typeof value === "string";
  if (typeof value !== "number") return words.includes(value);
  return value >= (at_least ?? -Infinity) && value <= (at_most ?? Infinity) && value > (above ?? -Infinity);
}

/** @param {import("./api.js").Option} option */
function expected({ kind, choices, words, at_least, at_most, above }) {
  if (kind === "choice") return `one of ${choices.join(", ")}`;
  if (kind === "switch") return "true or false";
  if (kind === "text") return "a text";
  const limits = [above !== null && `above ${above}`, at_least !== null && `from ${at_least}`, at_most !== null && `to ${at_most}`];
  return [["a number", ...limits.filter(Boolean)].join(" "), ...words].join(", or ");
}
