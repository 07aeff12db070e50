// @ts-check
/** The page: what the visitor does becomes the document, and the document is shown. */

import { ApiError, fetchOptions, isAborted } from "./api.js";
import { optionsOf } from "./command.js";
import { Controls } from "./controls.js";
import { entered } from "./entry.js";
import { Exports } from "./exports.js";
import { dropZone, onChosen, save } from "./files.js";
import { undoing } from "./history.js";
import { Intake } from "./intake.js";
import { Lighting } from "./lighting.js";
import { Panel } from "./panel.js";
import { ROLES } from "./pairs.js";
import { picking } from "./picking.js";
import { PointTools } from "./tools.js";
import { Preview } from "./preview.js";
import { Problems } from "./problems.js";
import { refill } from "./revival.js";
import { Seat } from "./seat.js";
import { share } from "./share.js";
import { showing } from "./showing.js";
import { Stage } from "./stage.js";
import { Store } from "./state.js";
import { FilmStrip } from "./strip.js";
import { Sync } from "./sync.js";
import { begin, hold, keep } from "./visit.js";

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {{faces: import("./pairs.js").Faces, options: Record<string, any>, reference: string,
 *   slot: string}} Document
 */

const SIDE = 1600; // px of a photo that is shown for its landmarks
const LAMP = "loop"; // the light of a photo that came alone

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const say = (/** @type {string} */ text) => ($("status").textContent = text);

async function start() {
  /** @type {(files: File[]) => void} */
  let drop = () => {};
  dropZone(document.documentElement, (files) => drop(files));
  const offer = await entered(fetchOptions);
  const { session, photos, kept, told } = await begin();
  /** @type {Record<Role, string>} */
  const names = kept?.names ?? { target: photos.target?.name ?? "", reference: photos.reference?.name ?? "" };
  /** @type {import("./revival.js").Files} of the photos in hand, where the page has them itself */
  const files = { target: null, reference: null };

  const controls = new Controls(offer.options, $("first"), $("more"));
  /** @type {Store<Document>} */
  const store = new Store({ faces: { target: null, reference: null }, options: controls.defaults, reference: "", slot: "a" });
  const sync = new Sync(session, () => refresh());
  const stage = new Stage($("stage"));
  const panels = /** @type {Record<Role, Panel>} */ (
    Object.fromEntries(ROLES.map((role) => [role, new Panel(role, $("photo"), offer.landmark_formats)]))
  );
  for (const role of ROLES) $("pair").append(panels[role].root);
  const problems = new Problems($("stage-problem"), panels);
  const tools = new PointTools(store, panels, say);
  /** Have the server know what the page knows. */
  const agree = async () => {
    if (!store.now.options.light) await seat.settled;
    await sync.push(() => store.now.faces);
  };
  const preview = new Preview((request, signal) => session.render(request, signal), agree);
  const lighting = new Lighting(session, offer, store, $("desk"), $("looks"), () =>
    photos.target && tools.usable("target") ? preview.sequence : null,
  );
  const { gallery } = lighting;
  const film = new FilmStrip($("film"), session, async () => {
    await agree();
    const { options, reference, faces } = store.now;
    return { options, reference: reference || null, marks: faces.reference, format: $("format").value };
  });

  const note = () => {
    const { names: references, looks } = gallery;
    const { options, reference } = store.now;
    keep({ session: session.token, names, options, reference, references, starred: [...looks.starred] });
  };

  /** Whether there is enough to relight. */
  const ready = () => {
    const lit = Boolean(store.now.options.light);
    return Boolean(photos.target && tools.usable("target") && (lit || (photos.reference && tools.paired)));
  };

  const exports = new Exports(session, stage.viewer, $("export"), $("copy-picture"), {
    attempt: (act, doing) => attempt(null, act, doing),
    request: async () => {
      await agree();
      const { options, reference } = store.now;
      return { options, reference: reference || null };
    },
    format: () => $("format").value,
    name: () => names.target,
    size: () => (ready() ? photos.target : null),
    say,
  });
  const refresh = () => {
    const able = ready();
    exports.able(able);
    $("swap").disabled = !(photos.target && photos.reference);
    const { options, reference } = store.now;
    const { wanted: views, side, fine } = stage;
    if (able) preview.ask({ options, reference: reference || null, views, side, fine });
    else preview.cancel();
    $("stage").classList.toggle("waiting", !able);
    $("stage").classList.toggle("seated", Boolean(photos.target));
    $("stage").classList.toggle("paired", Boolean(photos.target && photos.reference));
    if (!able && photos.target) say("The preview waits for photos and landmarks.");
    $("looks-box").hidden = !(photos.target && tools.usable("target"));
    $("desk").hidden = !photos.target;
    lighting.show(Boolean(photos.reference));
  };

  /** Whether a photo's face was neither found nor placed by hand. @param {Role} role */
  const faceless = (role) => Boolean(photos[role]?.message) && !tools.usable(role);

  /** A face that was not found is placed by hand: there. */
  const unsure = () => {
    if ($("fit").open || !ROLES.some(faceless)) return;
    $("fit").open = true;
    $("fit").scrollIntoView();
  };

  /** @param {Role} role @param {import("./api.js").Photo} photo @param {AbortSignal} [signal] */
  const showPhoto = async (role, photo, signal) => {
    const blob = await session.picture(role, SIDE);
    signal?.throwIfAborted();
    photos[role] = photo;
    panels[role].show(blob, photo, names[role]);
    problems.tell(role, photo.message ? `${names[role] || role}: ${photo.message}` : "");
    if (role !== "target") return lighting.desk.source(blob, names.reference);
    stage.before(blob, photo);
    gallery.looks.look(stage.face);
  };

  /**
   * @param {Partial<Record<Role, import("./api.js").Photo | null>>} given
   * @param {Partial<import("./revival.js").Files>} [from]
   */
  const take = async (given, from = {}) => {
    /** @type {Partial<Record<Role, import("./api.js").Marks | null>>} */
    const faces = {};
    for (const role of ROLES) {
      const photo = given[role];
      if (!photo) continue;
      const marks = film.frame(from[role])?.marks;
      faces[role] = marks ?? photo.landmarks;
      sync.knows(role, { target: null, reference: null, [role]: photo.landmarks });
      await showPhoto(role, marks ? { ...photo, landmarks: marks, message: null } : photo);
    }
    stage.clear();
    for (const role of ROLES) if (given[role]) files[role] = from[role] ?? null;
    film.inHand(files.target);
    // The other photo may have come meanwhile.
    const { options } = store.now;
    // A photo that is dropped for its light is what is wanted; one that is alone needs a lamp.
    const light = given.reference ? null : photos.reference ? options.light : (options.light ?? LAMP);
    store.reset({
      faces: { ...store.now.faces, ...faces },
      options: { ...options, light },
      reference: given.reference ? gallery.inUse : store.now.reference,
    });
    note();
    unsure();
    gallery.looks.renew();
  };

  /**
   * Do what the server may refuse, and show where.
   * @param {Role | null} role @param {() => Promise<void>} act @param {string} [doing]
   */
  const attempt = async (role, act, doing = "Working…") => {
    const busy = role ? [panels[role]] : ROLES.map((one) => panels[one]);
    for (const panel of busy) panel.busy(true);
    const slow = setTimeout(() => say(doing), 300);
    try {
      problems.tell(role ?? "work", "");
      await act();
    } catch (error) {
      if (isAborted(error)) return; // something newer is under way
      if (!(error instanceof ApiError)) throw error;
      problems.tell(role ?? "work", error.message);
      say("");
    } finally {
      clearTimeout(slow);
      for (const panel of busy) panel.busy(false);
      if ($("status").textContent === doing) say("");
    }
  };

  const seat = new Seat(gallery, sync, store, lighting, {
    attempt,
    leaving: () => film.left(),
    taken: (id, name) => {
      names.reference = name;
      files.reference = gallery.files.get(id) ?? null;
    },
    show: (photo, signal) => showPhoto("reference", photo, signal),
    note: () => {
      note();
      refresh();
    },
  });
  const intake = new Intake(session, sync, offer, attempt, lighting, {
    photos: async ({ target, reference }, from) => {
      if (reference) await seat.choose(reference);
      if (!target) return;
      names.target = from.target?.name ?? "";
      await take({ target }, { target: from.target });
    },
    marks: (role, marks) => {
      sync.knows(role, { target: null, reference: null, [role]: marks });
      store.set({ faces: { ...store.now.faces, [role]: marks } });
    },
  });
  /**
   * Two photos are a person and a light, more are a film strip. One goes where there is none, and beside a pair to the
   * references: nobody is replaced unasked. @param {File[]} given @param {Role} [role] that somebody said
   */
  const receive = async (given, role) => {
    const others = [];
    for (const file of given) {
      if (/\.json$/i.test(file.name) && (await optionsOf(file))) await loading(file);
      else others.push(file);
    }
    if (!others.length) return undefined;
    const pictures = others.filter((file) => !intake.isMarks(file));
    if (pictures.length > 2) {
      film.clear();
      film.add(pictures);
      return film.choose(0);
    }
    const empty = ROLES.find((one) => !photos[one]) ?? "reference";
    const lost = ROLES.find(faceless) ?? "target";
    for (const one of ROLES) if (!faceless(one)) problems.tell(one, "");
    return intake.receive(others, role ?? (pictures.length ? empty : lost));
  };
  drop = (files) => void receive(files);
  onChosen($("open"), (files) => void receive(files));
  for (const zone of document.querySelectorAll("#zones [data-role]")) {
    const { dataset } = /** @type {HTMLElement} */ (zone);
    dropZone(/** @type {HTMLElement} */ (zone), (files) => void receive(files, /** @type {Role} */ (dataset.role)));
  }
  film.addEventListener("choose", async (event) => {
    /** @type {import("./strip.js").Frame} */
    const frame = /** @type {CustomEvent} */ (event).detail;
    await intake.receive([frame.file], "target");
    film.told(frame, problems.now.target, files.target);
  });
  film.addEventListener("made", (event) => save(/** @type {CustomEvent<Blob>} */ (event).detail, "relit-photos.zip"));
  lighting.addEventListener("reference", (event) => void seat.choose(/** @type {CustomEvent<string>} */ (event).detail));
  lighting.addEventListener("note", note);
  const load = share(store, offer.options, () => names, (id) => id in gallery.names, say);
  const loading = (/** @type {File} */ file) => attempt(null, () => load(file));
  onChosen($("load-settings"), ([file]) => void loading(file));
  const { viewer } = stage;
  picking(viewer, $("pick"), (place) =>
    attempt(null, async () => {
      const { part } = await session.part(place);
      if (part) /** @type {HTMLElement} */ (document.querySelector(`[data-part=${part}]`)).click();
      else say("That is beside the face.");
    }),
  );
  for (const role of ROLES) {
    const panel = panels[role];
    panel.addEventListener("files", (event) => void intake.receive(/** @type {CustomEvent} */ (event).detail, role));
    panel.addEventListener("marks", (event) => void intake.marks(role, /** @type {CustomEvent} */ (event).detail));
    panel.addEventListener("save", (event) => {
      const format = /** @type {CustomEvent} */ (event).detail;
      void attempt(role, async () => {
        await agree();
        save(await session.saveLandmarks(role, format), `${role}${format}`);
      });
    });
  }

  $("samples").addEventListener("click", () =>
    attempt(null, async () => {
      for (const newest of [intake.target, lighting.newest, seat.newest]) newest.next();
      await sync.exchange(ROLES, async () => {
        const given = await session.samples();
        Object.assign(names, { target: "target.png", reference: "reference.jpg" }); // as `relit samples` writes them
        gallery.seat("sample", names.reference);
        await take(given);
      });
    }),
  );
  $("swap").addEventListener("click", () =>
    attempt(null, async () => {
      await agree();
      await sync.exchange(ROLES, async () => {
        film.left();
        const { id, ...given } = await session.swap();
        Object.assign(names, { target: names.reference, reference: names.target });
        Object.assign(files, { target: files.reference, reference: files.target });
        if (files.reference) gallery.files.set(id, files.reference);
        film.inHand(files.target);
        sync.held = { target: sync.held.reference, reference: sync.held.target };
        gallery.seat(id, names.reference || "target");
        for (const role of ROLES) await showPhoto(role, given[role]);
        // What was done with other references has the one now in the target's seat in theirs.
        const { reference, faces } = store.now;
        store.map((one) => {
          const target = one.reference === reference ? one.faces.reference : faces.reference;
          return { ...one, faces: { target, reference: one.faces.target }, reference: id };
        });
        gallery.looks.renew();
        note();
      });
      say("Target and reference have changed places.");
    }),
  );
  $("snap").addEventListener("click", async () => {
    const faces = { ...store.now.faces };
    for (const role of ROLES) {
      if (!photos[role]) continue;
      await attempt(role, async () => {
        faces[role] = await session.detect(role);
        sync.knows(role, { target: null, reference: null, [role]: faces[role] });
      });
    }
    tools.add(false);
    store.set({ faces });
  });
  undoing(store, $("undo"), $("redo"));

  controls.addEventListener("change", (event) => {
    const { name, value } = /** @type {CustomEvent} */ (event).detail;
    store.set({ options: { ...store.now.options, [name]: value } }, `option ${name}`);
  });
  $("controls").addEventListener("change", () => store.pause());
  $("controls").addEventListener("submit", (/** @type {Event} */ event) => event.preventDefault());
  $("reset").addEventListener("click", () => store.set({ options: { ...controls.defaults, light: photos.reference ? null : LAMP } }));

  store.addEventListener("change", (event) => {
    const { before } = /** @type {CustomEvent<{before: Document}>} */ (event).detail;
    if (before.options !== store.now.options) {
      controls.show(store.now.options);
      note();
    }
    const { target } = store.now.faces;
    if (before.faces.target !== target) film.placed(files.target, target);
    tools.show();
    refresh();
  });
  stage.addEventListener("open", refresh);

  showing(preview, stage, controls, problems, {
    looks: gallery.looks,
    say,
    said: () => $("status").textContent,
    blame: (text) => ($("points-problem").textContent = text),
    came: ({ lamps, fill, finest }) => {
      // A face that was placed by hand is found.
      for (const role of ROLES) if (photos[role]?.message && !faceless(role)) problems.tell(role, "");
      lighting.desk.light(lamps, fill);
      panels.target.points.finest = finest;
      panels.target.points.draw();
      $("finest").textContent = finest
        ? `What is below ${finest.toFixed(1)} px stays the person's: the circle λ on the target.`
        : "";
    },
  });

  await gallery.restore(kept?.references ?? {}, kept?.starred ?? []);
  gallery.inUse = gallery.asked = kept?.reference ?? "";
  store.reset({ options: { ...controls.defaults, ...kept?.options }, reference: gallery.inUse });
  await take(photos);
  if (kept?.options) store.reset({ options: { ...controls.defaults, ...kept.options } });
  session.refill = (fresh) => refill(fresh, files, gallery, store.now);
  session.renewed = () => {
    void hold(session.token);
    note();
    say("The studio had the photos no more; they were sent to it again.");
  };
  if (told) say(told);
  $("samples").disabled = false;
}

start().catch((error) => {
  $("stage-problem").textContent = error.message;
  if (!(error instanceof ApiError)) throw error;
});
