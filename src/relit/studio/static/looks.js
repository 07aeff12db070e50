// @ts-check
/** A strip of looks: what lights by name, and photos that were dropped, make of the face in hand. */

/** @typedef {{key: string, label: string, light: string | null, reference: string | null}} Look */

export class Looks extends EventTarget {
  /** @param {HTMLElement} root @param {(look: Look, signal: AbortSignal) => Promise<Blob | null>} thumbnail null: later */
  constructor(root, thumbnail) {
    super();
    this.root = root;
    this.thumbnail = thumbnail;
    /** @type {Look[]} */
    this.looks = [];
    /** @type {Set<string>} */
    this.starred = new Set();
    /** @type {Map<string, HTMLElement>} */
    this.cards = new Map();
    /** @type {Set<string>} those whose picture is of another face, or of none */
    this.old = new Set();
    this.run = new AbortController();
    /** @type {string | null} */
    this.chosen = null;
  }

  /** Show these, the starred first. @param {Look[]} looks */
  show(looks) {
    const rank = (/** @type {Look} */ { key }) => (this.starred.has(key) ? 0 : 1);
    this.looks = [...looks].sort((a, b) => rank(a) - rank(b));
    for (const [key, card] of this.cards) if (!looks.some((look) => look.key === key)) card.remove(), this.cards.delete(key);
    for (const look of this.looks) {
      if (!this.cards.has(look.key)) this.old.add(look.key);
      const card = this.cards.get(look.key) ?? this.#card(look);
      this.cards.set(look.key, card);
      this.root.append(card); // in their order
    }
    this.looks.forEach(({ key }, k) => {
      const star = this.starred.has(key);
      const [choose, keep] = /** @type {HTMLElement[]} */ ([...(this.cards.get(key)?.children ?? [])]);
      choose.setAttribute("aria-keyshortcuts", k < 9 ? String(k + 1) : "");
      choose.title = k < 9 ? `Key ${k + 1}` : "";
      keep.textContent = star ? "★" : "☆";
      keep.setAttribute("aria-pressed", String(star));
    });
  }

  /** Where the face is that pictures are to show, in shares of the photo. @param {number[]} box left, top, right, bottom */
  look([left, top, right, bottom]) {
    const closer = Math.min(Math.max(0.6 / Math.max(right - left, bottom - top), 1), 4);
    const values = { "--face-x": (left + right) / 2, "--face-y": (top + bottom) / 2, "--closer": closer };
    for (const [name, value] of Object.entries(values)) this.root.style.setProperty(name, String(value));
  }

  /** Which one is in use. @param {string | null} chosen */
  mark(chosen) {
    for (const [key, card] of this.cards) card.firstElementChild?.setAttribute("aria-pressed", String(key === chosen));
    if (chosen === this.chosen) return;
    this.chosen = chosen;
    const card = this.cards.get(chosen ?? "");
    // Along the strip alone: the page stays where it is.
    if (card) this.root.scrollLeft = card.offsetLeft - this.root.offsetLeft - (this.root.clientWidth - card.clientWidth) / 2;
  }

  /** The look of a key from 1 to 9. @param {number} number */
  pick(number) {
    const look = this.looks[number - 1];
    if (look) this.#say("choose", look);
  }

  /** All pictures are of the face that was there before. */
  renew() {
    this.run.abort();
    this.old = new Set(this.cards.keys());
  }

  /** Make what pictures are wanting, one after the other, until a preview overtakes them. */
  async go() {
    this.run.abort();
    const { signal } = (this.run = new AbortController());
    for (const look of this.looks.filter(({ key }) => this.old.has(key))) {
      const blob = await this.thumbnail(look, signal);
      const image = this.cards.get(look.key)?.querySelector("img");
      if (signal.aborted || !blob) return;
      this.old.delete(look.key);
      if (!image) continue;
      URL.revokeObjectURL(image.src);
      image.src = URL.createObjectURL(blob);
    }
  }

  /** @param {Look} look */
  #card(look) {
    const card = document.createElement("li");
    const choose = Object.assign(document.createElement("button"), { type: "button", className: "look" });
    choose.setAttribute("aria-pressed", "false");
    const label = Object.assign(document.createElement("span"), { textContent: look.label });
    const window = Object.assign(document.createElement("span"), { className: "window" });
    window.append(Object.assign(new Image(), { alt: "", draggable: false }));
    choose.append(window, label);
    choose.addEventListener("click", () => this.#say("choose", look));
    const star = Object.assign(document.createElement("button"), { type: "button", className: "star" });
    star.setAttribute("aria-label", `Keep ${look.label} in front`);
    star.addEventListener("click", () => {
      if (!this.starred.delete(look.key)) this.starred.add(look.key);
      this.show(this.looks);
      star.focus();
      this.#say("star", [...this.starred]);
    });
    card.append(choose, star);
    if (look.reference) {
      const drop = Object.assign(document.createElement("button"), { type: "button", className: "star away", textContent: "×" });
      drop.setAttribute("aria-label", `Take ${look.label} out`);
      drop.addEventListener("click", () => this.#say("remove", look));
      card.append(drop);
    }
    return card;
  }

  /** @param {string} type @param {unknown} detail */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
