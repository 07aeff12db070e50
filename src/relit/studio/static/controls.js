// @ts-check
/** A form made of what the server says of its options: names, ranges, words and help. */

/** @typedef {import("./api.js").Option} Option */

/** What a photographer sets, in this order; everything else is for experts. */
const FIRST = ["strength", "softness", "fill", "turn", "tilt", "exposure", "shadows", "highlights", "tint", "region"];
const NUMBER = "#"; // choice of the select that stands for the number beside it

export class Controls extends EventTarget {
  /** @param {Option[]} options @param {HTMLElement} first @param {HTMLElement} more */
  constructor(options, first, more) {
    super();
    this.options = options;
    /** @type {Map<string, {show: (value: any) => void, problem: HTMLElement}>} */
    this.fields = new Map();
    const rank = (/** @type {Option} */ { name }) => (FIRST.indexOf(name) + FIRST.length + 1) % (FIRST.length + 1);
    for (const option of [...options].sort((a, b) => rank(a) - rank(b))) {
      (FIRST.includes(option.name) ? first : more).append(this.#field(option));
    }
  }

  /** @returns {Record<string, any>} */
  get defaults() {
    return Object.fromEntries(this.options.map((option) => [option.name, option.default]));
  }

  /** @param {Record<string, any>} values */
  show(values) {
    for (const [name, field] of this.fields) field.show(values[name]);
  }

  /** Show a refusal beside the option that it begins with; false if it names none. @param {string} message */
  blame(message) {
    this.forgive();
    const named = this.options.find(
      ({ name, flag }) => message.startsWith(`${name}:`) || message.startsWith(`${flag}:`),
    );
    const field = named && this.fields.get(named.name);
    if (field) field.problem.textContent = this.#worded(message.replace(/^[^:]*/, titled(named)));
    return Boolean(field);
  }

  /** What the server says of the command line, as what is seen here: flags are controls. @param {string} text */
  #worded(text) {
    for (const option of this.options) {
      const name = option.flag.slice(2);
      // A symbol in brackets is for the label alone.
      const title = titled(option).replace(/ \(.*\)$/, "");
      text = text.replaceAll(`--no-${name}`, `${title} off`).replaceAll(option.flag, title);
    }
    return text.replace(/\b(TARGET|REFERENCE)\b/g, (word) => word.toLowerCase());
  }

  forgive() {
    for (const { problem } of this.fields.values()) problem.textContent = "";
  }

  /** @param {Option} option */
  #field(option) {
    const box = make("div", { className: `field ${option.kind}` });
    const id = `option-${option.name}`;
    const title = titled(option);
    const label = make("label", { htmlFor: id, textContent: title });
    const help = this.#worded(option.help);
    const hint = make("p", { id: `${id}-help`, className: "hint", textContent: help });
    const problem = make("p", { id: `${id}-problem`, className: "problem" });
    problem.setAttribute("role", "alert");
    const say = (/** @type {any} */ value) =>
      this.dispatchEvent(new CustomEvent("change", { detail: { name: option.name, value } }));
    const { parts, words, show } = (option.name === "region" ? regions : KINDS[option.kind])(option, id, say);
    for (const part of [...parts, words]) part?.setAttribute("aria-describedby", `${hint.id} ${problem.id}`);
    const row = make("div", { className: "row" });
    row.append(...parts);
    const more = make("button", { type: "button", className: "help", textContent: "?" });
    more.setAttribute("aria-label", `Help on ${title}`);
    more.setAttribute("aria-expanded", "false");
    more.setAttribute("aria-controls", hint.id);
    more.addEventListener("click", () => {
      more.setAttribute("aria-expanded", String(hint.classList.toggle("open")));
    });
    const head = make("div", { className: "head" });
    head.append(label, more, hint);
    if (words) head.append(words);
    box.append(head, row, problem);
    this.fields.set(option.name, { show, problem });
    return box;
  }
}

/** @type {Record<string, (option: Option, id: string, say: (value: any) => void) => {parts: HTMLElement[], words?: HTMLElement, show: (value: any) => void}>} */
const KINDS = {
  switch(_option, id, say) {
    const box = make("input", { type: "checkbox", id });
    box.addEventListener("change", () => say(box.checked));
    return { parts: [box], show: (value) => (box.checked = value) };
  },

  choice(option, id, say) {
    const select = make("select", { id });
    option.choices.forEach((choice, k) => select.append(new Option(String(choice), String(k))));
    select.addEventListener("change", () => say(option.choices[Number(select.value)]));
    return { parts: [select], show: (value) => (select.value = String(option.choices.indexOf(value))) };
  },

  text(option, id, say) {
    const input = make("input", { type: "text", id, spellcheck: false, autocomplete: "off" });
    const known = option.words?.length ? option.words : option.choices;
    input.placeholder = option.default === null ? "none" : "";
    input.addEventListener("change", () => say(input.value.trim() || option.default));
    const show = (/** @type {any} */ value) => {
      input.value = value ?? "";
    };
    if (!known?.length) return { parts: [input], show };
    const list = make("datalist", { id: `${id}-known` });
    for (const word of known) list.append(new Option(word));
    input.setAttribute("list", list.id);
    return { parts: [input, list], show };
  },

  number(option, id, say) {
    const { least, most, log, steps } = rangeOf(option);
    const slid = most !== null;
    const slider = make("input", { type: "range", id, min: "0", max: String(steps), step: "1" });
    const number = make("input", { type: "number", step: "0.01", id: slid ? `${id}-number` : id });
    if (option.at_least !== null) number.min = String(option.at_least);
    if (option.at_most !== null) number.max = String(option.at_most);
    number.setAttribute("aria-label", `${titled(option)}, as a number`);
    const words = make("select", { id: `${id}-words` });
    words.setAttribute("aria-label", `${titled(option)}, as a word`);
    if (option.default === null) words.append(new Option("automatic", ""));
    words.append(new Option("number", NUMBER));
    for (const word of option.words) words.append(new Option(word, word));
    const start = typeof option.default === "number" ? option.default : Math.max(least, 0);
    let last = start;

    const top = most ?? 1;
    const toPlace = (/** @type {number} */ value) =>
      steps * (log ? Math.log(value / least) / Math.log(top / least) : (value - least) / (top - least));
    const toValue = (/** @type {number} */ place) => {
      const share = place / steps;
      const value = log ? least * (top / least) ** share : least + share * (top - least);
      return Number(value.toPrecision(3));
    };
    const show = (/** @type {any} */ value) => {
      const free = typeof value === "number";
      if (free) last = value;
      words.value = free ? NUMBER : (value ?? "");
      number.value = free ? String(value) : "";
      slider.value = String(toPlace(last));
      slider.setAttribute("aria-valuetext", String(value));
      // A word needs no number beside it.
      slider.hidden = number.hidden = !free;
    };
    slider.addEventListener("input", () => say(toValue(Number(slider.value))));
    number.addEventListener("change", () => {
      if (number.value === "") show(last);
      if (Number.isFinite(number.valueAsNumber)) say(number.valueAsNumber);
    });
    words.addEventListener("change", () => say(words.value === NUMBER ? last : words.value || null));
    const parts = slid ? [slider, number] : [number];
    return { parts, words: words.length > 1 ? words : undefined, show };
  },
};

/** Parts of a face, to choose several of. @type {typeof KINDS[string]} */
function regions(option, id, say) {
  const parts = make("div", { className: "chips", id });
  const pick = make("button", { type: "button", id: "pick", className: "chip", textContent: "Pick on the face" });
  parts.setAttribute("role", "group");
  parts.setAttribute("aria-label", titled(option));
  /** @type {Set<string>} */
  let chosen = new Set();
  const buttons = option.words.map((word) => {
    const button = make("button", { type: "button", className: "chip", textContent: word });
    button.dataset.part = word;
    button.addEventListener("click", () => {
      const others = new Set([...chosen].filter((one) => one !== "face"));
      if (word !== "face" && !others.delete(word)) others.add(word);
      say(word === "face" || !others.size ? "face" : option.words.filter((one) => others.has(one)).join("+"));
    });
    parts.append(button);
    return button;
  });
  parts.append(pick);
  const show = (/** @type {any} */ value) => {
    chosen = new Set(String(value ?? "face").split("+"));
    for (const button of buttons) button.setAttribute("aria-pressed", String(chosen.has(button.textContent ?? "")));
  };
  return { parts: [parts], show };
}

/** What a control is called. @param {Option} option */
function titled({ flag, title }) {
  if (title) return title;
  const words = flag.replace(/^-+/, "").replaceAll("-", " ");
  return words[0].toUpperCase() + words.slice(1);
}

/**
 * From where to where a slider goes, and in how many steps: as far as the option does, or tenfold round the
 * default of one that only has to be above 0.
 * @param {Option} option
 */
function rangeOf({ at_least, at_most, above, default: standard }) {
  if (above !== null && at_most === null) return { least: standard / 10, most: standard * 10, log: true, steps: 100 };
  const least = at_least ?? above ?? 0;
  const range = (at_most ?? 1) - least;
  return { least, most: at_most, log: false, steps: Math.round(range / (range > 2 ? 0.05 : 0.01)) };
}

/**
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag @param {Record<string, unknown>} properties
 * @returns {HTMLElementTagNameMap[K]}
 */
function make(tag, properties) {
  return Object.assign(document.createElement(tag), properties);
}
