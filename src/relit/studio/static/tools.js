// @ts-check
/** What is done to the landmarks of both photos together: choosing, adding, deleting, groups. */

import { LEAST, ROLES, added, moved, nothing, other, pairable, placed, removable, removed, toSend } from "./pairs.js";

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {import("./main.js").Document} Document
 */

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

export class PointTools {
  /**
   * @param {import("./state.js").Store<Document>} store
   * @param {Record<Role, import("./panel.js").Panel>} panels
   * @param {(text: string) => void} say
   */
  constructor(store, panels, say) {
    this.store = store;
    this.panels = panels;
    this.say = say;
    /** @type {Set<string>} groups that are switched off */
    this.off = new Set();
    /** @type {number | null} */
    this.chosen = null;
    this.adding = false;
    this.listed = "";
    for (const role of ROLES) this.#listen(role);
    $("point").addEventListener("change", () => this.choose($("point").value === "" ? null : Number($("point").value)));
    $("add").addEventListener("click", () => this.add(!this.adding));
    $("remove").addEventListener("click", () => this.remove());
    $("by-hand").addEventListener("click", () => {
      this.chosen = null;
      this.add(true);
      store.set({ faces: nothing(this.alone) });
    });
  }

  get faces() {
    return this.store.now.faces;
  }

  /** Whether the target has no reference beside it, and needs no pairs. */
  get alone() {
    return !this.#filled("reference");
  }

  /** @param {Role} role */
  #filled(role) {
    return this.panels[role].root.classList.contains("filled");
  }

  /** The rows that can be had, group by group. @returns {[string, number[]][]} */
  get groups() {
    const marks = this.faces.target ?? this.faces.reference;
    return Object.entries(marks?.groups ?? {});
  }

  /** Whether a face can be worked with. @param {Role} role */
  usable(role) {
    return toSend(this.faces, role) !== null;
  }

  /** Whether one face can be laid on the other. */
  get paired() {
    return this.usable("reference") && pairable(this.faces);
  }

  /** @param {number | null} row */
  choose(row) {
    this.chosen = row;
    for (const role of ROLES) {
      const point = row === null ? null : this.faces[role]?.points[row];
      if (point) this.panels[role].viewport.reveal(point);
    }
    this.show();
  }

  /** @param {boolean} on */
  add(on) {
    this.adding = on;
    this.show();
  }

  remove() {
    const { alone } = this;
    if (this.chosen === null || !removable(this.faces, alone)) return;
    const row = this.chosen;
    this.chosen = null;
    this.store.set({ faces: removed(this.faces, row, alone) });
    this.say(`${alone ? "Point" : "Pair"} ${row} deleted.`);
  }

  /** Draw everything anew. */
  show() {
    const { faces } = this;
    const lacking = ROLES.some((role) => this.#filled(role) && !faces[role]);
    $("landmarks").hidden = !ROLES.some((role) => this.#filled(role));
    const rows = new Set(this.groups.filter(([name]) => !this.off.has(name)).flatMap(([, group]) => group));
    if (this.chosen !== null && !ROLES.some((role) => faces[role]?.points[/** @type {number} */ (this.chosen)])) this.chosen = null;
    for (const role of ROLES) {
      const { points } = this.panels[role];
      const partners = faces[other(role)]?.points;
      points.marks = faces[role];
      points.live = rows;
      points.alone = new Set(
        faces[role]?.scheme === "points" && partners
          ? faces[role].points.flatMap((point, row) => (point && !partners[row] ? [row] : []))
          : [],
      );
      points.adding = this.adding;
      points.chosen = this.chosen;
      points.frame.classList.toggle("adding", this.adding);
      points.draw();
    }
    $("add").setAttribute("aria-pressed", String(this.adding));
    $("remove").disabled = this.chosen === null || !removable(faces, this.alone);
    $("points-note").textContent = this.#note(lacking);
    this.#list();
  }

  /** @param {boolean} lacking */
  #note(lacking) {
    const { target, reference } = this.faces;
    if (this.alone) {
      if (!target && !this.adding) return "Nobody knows where the face is: press From nothing and click places all over it, or load a file.";
      const count = target?.scheme === "points" ? placed(target) : LEAST;
      if (count < LEAST) return `${count} of at least ${LEAST} points placed. Click places all over the face, its outline too.`;
      return this.adding ? "Click more places all over the face, its outline too." : "";
    }
    if (lacking && !this.adding) return "Without landmarks a photo cannot be laid on the other: press From nothing and click pairs of places, or load a file.";
    const byHand = target?.scheme === "points" && reference?.scheme === "points";
    const open = byHand ? target.points.findIndex((point, row) => !point || !reference.points[row]) : -1;
    if (byHand && open >= 0) {
      return `Now click the place of point ${open} in the ${target.points[open] ? "reference" : "target"}.`;
    }
    const pairs = byHand ? target.points.length : LEAST;
    if (pairs < LEAST) return `${pairs} of at least ${LEAST} pairs placed. Click a place in the target, then the same place in the reference.`;
    if (this.adding) return "Click a place in the target, then the same place in the reference.";
    if (target && reference && !pairable(this.faces)) {
      return `The target has ${placed(target)} points (${target.scheme}), the reference ${placed(reference)} (${reference.scheme}): load two files of one kind, or press Automatic.`;
    }
    return "";
  }

  /** @param {Role} role */
  #listen(role) {
    const { points } = this.panels[role];
    /** @param {string} type @param {(detail: any) => void} act */
    const on = (type, act) =>
      points.addEventListener(type, (event) => act(/** @type {CustomEvent} */ (event).detail));
    on("hover", ({ row }) => {
      for (const one of ROLES) {
        this.panels[one].points.hovered = row;
        this.panels[one].points.draw();
      }
    });
    on("choose", ({ row }) => {
      this.store.pause();
      this.chosen = row;
      this.show();
    });
    on("move", ({ row, place, tag, spoken }) => {
      const { width, height } = this.panels[role].viewport;
      const inside = [width, height].map((size, axis) => Math.min(Math.max(place[axis], 0), size - 1));
      this.store.set({ faces: moved(this.faces, role, row, inside) }, `${role} ${tag}`);
      if (spoken) this.say(`Point ${row} of the ${role}: ${inside.map((at) => at.toFixed(1)).join(", ")}`);
    });
    on("add", ({ place }) => {
      const { faces, row } = added(this.faces, role, place, this.alone);
      this.chosen = row;
      this.store.set({ faces });
      this.say(this.#note(false) || `Point ${row} placed.`);
    });
    on("remove", () => this.remove());
    on("step", ({ by }) => {
      const rows = [...$("point").options].map((option) => option.value).filter(Boolean).map(Number);
      const at = this.chosen === null ? (by > 0 ? -1 : 0) : rows.indexOf(this.chosen);
      if (rows.length) this.choose(rows[(at + by + rows.length) % rows.length]);
      this.say(this.chosen === null ? "" : `Point ${this.chosen}`);
    });
  }

  /** The list of points and the switches of groups, made anew only when there are others. */
  #list() {
    const text = JSON.stringify([this.groups, [...this.off]]);
    if (text !== this.listed) {
      this.listed = text;
      const list = $("point");
      list.replaceChildren(new Option("none", ""));
      const legend = $("groups").firstElementChild;
      $("groups").replaceChildren(legend);
      const seen = new Set();
      for (const [name, rows] of this.groups) {
        $("groups").append(this.#switch(name));
        if (this.off.has(name)) continue;
        const group = document.createElement("optgroup");
        group.label = name.replaceAll("_", " ");
        for (const row of rows) {
          if (!seen.has(row)) group.append(new Option(`${group.label} ${row}`, String(row)));
          seen.add(row);
        }
        list.append(group);
      }
      $("groups").hidden = this.groups.length < 2;
    }
    $("point").value = this.chosen ?? "";
    $("place").textContent = ROLES.map((role) => {
      const point = this.chosen === null ? null : this.faces[role]?.points[this.chosen];
      return point ? `${role} ${point[0].toFixed(1)}, ${point[1].toFixed(1)}` : "";
    })
      .filter(Boolean)
      .join(" · ");
  }

  /** @param {string} name */
  #switch(name) {
    const label = document.createElement("label");
    const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: !this.off.has(name) });
    box.addEventListener("change", () => {
      if (box.checked) this.off.delete(name);
      else this.off.add(name);
      this.listed = "";
      const focused = `#groups input[value="${name}"]`;
      this.show();
      /** @type {HTMLElement | null} */ (document.querySelector(focused))?.focus();
    });
    box.value = name;
    label.className = "chip";
    label.append(box, name.replaceAll("_", " "));
    return label;
  }
}
