// @ts-check
/** The page: what the visitor does becomes the document, and the document is shown. */

import { ApiError, fetchOptions } from "./api.js";
import { optionsOf } from "./command.js";
import { Controls } from "./controls.js";
import { entered } from "./entry.js";
import { dropZone, onChosen, save } from "./files.js";
import { Intake } from "./intake.js";
import { Lighting } from "./lighting.js";
import { copied } from "./outgoing.js";
import { Panel } from "./panel.js";
import { ROLES } from "./pairs.js";
import { picking } from "./picking.js";
import { PointTools } from "./tools.js";
import { Preview } from "./preview.js";
import { Problems } from "./problems.js";
import { share } from "./share.js";
import { Stage } from "./stage.js";
import { Store } from "./state.js";
import { FilmStrip } from "./strip.js";
import { Sync } from "./sync.js";
import { begin, keep } from "./visit.js";
import { first } from "./zip.js";

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
  const { session, photos, kept } = await begin();
  /** @type {Record<Role, string>} */
  let names = kept?.names ?? { target: "", reference: "" };
  let took = 0;

  const controls = new Controls(offer.options, $("first"), $("more"));
  /** @type {Store<Document>} */
  const store = new Store({ faces: { target: null, reference: null }, options: controls.defaults, reference: "", slot: "a" });
  const sync = new Sync(session);
  const stage = new Stage($("stage"));
  const panels = /** @type {Record<Role, Panel>} */ (
    Object.fromEntries(ROLES.map((role) => [role, new Panel(role, $("photo"), offer.landmark_formats)]))
  );
  for (const role of ROLES) $("pair").append(panels[role].root);
  const problems = new Problems($("stage-problem"), panels);
  const tools = new PointTools(store, panels, say);
  let seated = Promise.resolve(); // until the server has the reference that is chosen
  const preview = new Preview(
    (request, signal) => session.render(request, signal),
    () => seated.then(() => sync.push(() => store.now.faces)),
  );
  const lighting = new Lighting(session, offer, store, $("desk"), $("looks"), () =>
    photos.target && tools.usable("target") ? preview.sequence : null,
  );
  const { gallery } = lighting;
  const film = new FilmStrip($("film"), session);

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

  const refresh = () => {
    const able = ready();
    $("export").disabled = !able;
    $("swap").disabled = !(photos.target && photos.reference);
    $("undo").disabled = !store.past.length;
    $("redo").disabled = !store.future.length;
    if (able) preview.ask({ options: store.now.options, views: stage.wanted, side: stage.side, fine: stage.fine });
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

  /** @param {Role} role @param {import("./api.js").Photo} photo */
  const showPhoto = async (role, photo) => {
    photos[role] = photo;
    const blob = await session.picture(role, SIDE);
    panels[role].show(blob, photo, names[role]);
    problems.tell(role, photo.message ? `${names[role] || role}: ${photo.message}` : "");
    if (role !== "target") return lighting.desk.source(blob, names.reference);
    stage.before(blob, photo);
    gallery.looks.look(stage.face);
  };

  /** @param {Partial<Record<Role, import("./api.js").Photo | null>>} given */
  const take = async (given) => {
    /** @type {Partial<Record<Role, import("./api.js").Marks | null>>} */
    const faces = {};
    for (const role of ROLES) {
      const photo = given[role];
      if (!photo) continue;
      faces[role] = photo.landmarks;
      sync.knows(role, { target: null, reference: null, [role]: photo.landmarks });
      await showPhoto(role, photo);
    }
    stage.clear();
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
      if (!(error instanceof ApiError)) throw error;
      problems.tell(role ?? "work", error.message);
      say("");
    } finally {
      clearTimeout(slow);
      for (const panel of busy) panel.busy(false);
      if ($("status").textContent === doing) say("");
    }
  };

  const intake = new Intake(session, offer, attempt, (file) => gallery.add(file), {
    photos: (given, called) => {
      names = { ...names, ...called };
      return take(given);
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
    const files = [];
    for (const file of given) {
      if (/\.json$/i.test(file.name) && (await optionsOf(file))) await loading(file);
      else files.push(file);
    }
    if (!files.length) return undefined;
    const pictures = files.filter((file) => !intake.isMarks(file));
    if (pictures.length > 2) {
      film.clear();
      film.add(pictures);
      return film.choose(0);
    }
    const empty = ROLES.find((one) => !photos[one]) ?? "reference";
    const lost = ROLES.find(faceless) ?? "target";
    for (const one of ROLES) if (!faceless(one)) problems.tell(one, "");
    return intake.receive(files, role ?? (pictures.length ? empty : lost));
  };
  drop = (files) => void receive(files);
  onChosen($("open"), (files) => void receive(files));
  for (const zone of document.querySelectorAll("#zones [data-role]")) {
    const { dataset } = /** @type {HTMLElement} */ (zone);
    dropZone(/** @type {HTMLElement} */ (zone), (files) => void receive(files, /** @type {Role} */ (dataset.role)));
  }
  film.addEventListener("choose", async (event) => {
    const { at, file } = /** @type {CustomEvent} */ (event).detail;
    const before = photos.target;
    await intake.receive([file], "target");
    film.told(at, photos.target !== before, problems.now.target);
  });
  film.addEventListener("all", async () => {
    await sync.push(() => store.now.faces);
    const made = await film.export(store.now.options, $("format").value);
    if (made) save(made, "relit-photos.zip");
  });

  /** Show a reference that the server has seated, by its number in the gallery. @param {string} id */
  const seat = async (id) => {
    const photo = await gallery.use(id);
    names.reference = gallery.names[id];
    sync.knows("reference", { target: null, reference: photo.landmarks });
    await showPhoto("reference", photo);
    return photo.landmarks;
  };
  lighting.addEventListener("reference", (event) => {
    const id = /** @type {CustomEvent<string>} */ (event).detail;
    void attempt("reference", async () => {
      const had = !photos.reference || Boolean(store.now.reference);
      const change = { options: lighting.ofPhoto, faces: { ...store.now.faces, reference: await seat(id) }, reference: id };
      // What was there before cannot be had back if it is not in the gallery.
      if (had) store.set(change);
      else store.reset(change);
      note();
    });
  });
  lighting.addEventListener("note", note);
  gallery.addEventListener("gone", (event) => {
    // It stays in use, if it is; what was done with it before cannot be had back.
    const { reference } = store.now;
    store.reset({ reference: reference === /** @type {CustomEvent<string>} */ (event).detail ? "" : reference });
    note();
  });
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
  viewer.file = () => {
    const { src = "", naturalWidth, naturalHeight } = viewer.pictures.after ?? {};
    return { url: src, name: `${(names.target || "photo").replace(/\.[^.]*$/, "")}-relit-${naturalWidth}x${naturalHeight}.jpg` };
  };
  $("copy-picture").addEventListener("click", () => {
    if (!ready()) return say("There is no picture yet.");
    return attempt(null, async () => {
      const { width, height } = /** @type {import("./api.js").Photo} */ (photos.target);
      const png = sync
        .push(() => store.now.faces)
        .then(() => session.export({ options: store.now.options, format: ".png" }))
        .then(({ file }) => first(file));
      const refused = await copied(png);
      await png; // what the server refuses is its to tell
      say(refused || `Copied the picture, ${width} × ${height}.`);
    }, "Making it in full resolution…");
  });

  for (const role of ROLES) {
    const panel = panels[role];
    panel.addEventListener("files", (event) => void intake.receive(/** @type {CustomEvent} */ (event).detail, role));
    panel.addEventListener("marks", (event) => void intake.marks(role, /** @type {CustomEvent} */ (event).detail));
    panel.addEventListener("save", (event) => {
      const format = /** @type {CustomEvent} */ (event).detail;
      void attempt(role, async () => {
        await sync.push(() => store.now.faces);
        save(await session.saveLandmarks(role, format), `${role}${format}`);
      });
    });
  }

  $("samples").addEventListener("click", () =>
    attempt(null, async () => {
      const given = await session.samples();
      names = { target: "target.png", reference: "reference.jpg" }; // as `relit samples` writes them
      gallery.seat("sample", names.reference);
      await take(given);
    }),
  );
  $("swap").addEventListener("click", () =>
    attempt(null, async () => {
      await sync.push(() => store.now.faces);
      const { id, ...given } = await session.swap();
      names = { target: names.reference, reference: names.target };
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
  $("export").addEventListener("click", () =>
    attempt(null, async () => {
      await sync.push(() => store.now.faces);
      const { file, lost } = await session.export({ options: store.now.options, format: $("format").value });
      save(file, "relit.zip");
      say(lost.length ? `Exported relit.zip. This format does not keep ${lost.join(", ")}.` : "Exported relit.zip.");
    }, "Exporting in full resolution…"),
  );
  $("undo").addEventListener("click", () => store.undo());
  $("redo").addEventListener("click", () => store.redo());
  window.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement && ["text", "number"].includes(event.target.type);
    if (!(event.ctrlKey || event.metaKey) || typing || !["z", "y"].includes(event.key.toLowerCase())) return;
    event.preventDefault();
    if (event.shiftKey || event.key.toLowerCase() === "y") store.redo();
    else store.undo();
  });

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
    const { reference } = store.now;
    if (reference && reference !== gallery.inUse) {
      // Undone, or redone.
      seated = attempt("reference", () => seat(reference).then(() => {}));
    }
    tools.show();
    refresh();
  });
  stage.addEventListener("open", refresh);

  preview.addEventListener("busy", (event) => {
    const busy = /** @type {CustomEvent} */ (event).detail;
    $("stage").classList.toggle("busy", busy);
    if (busy) say("Relighting…");
    else if ($("status").textContent === "Relighting…") say("");
  });
  preview.addEventListener("settled", (event) => {
    $("stage").setAttribute("aria-busy", String(!(/** @type {CustomEvent} */ (event).detail)));
  });
  preview.addEventListener("picture", (event) => {
    /** @type {import("./preview.js").Picture} */
    const picture = /** @type {CustomEvent} */ (event).detail;
    controls.forgive();
    problems.tell("work", "");
    $("points-problem").textContent = "";
    // A face that was placed by hand is found.
    for (const role of ROLES) if (photos[role]?.message && !faceless(role)) problems.tell(role, "");
    stage.show(picture);
    lighting.desk.light(picture.lamps, picture.fill);
    const { finest, seconds } = picture;
    took = seconds;
    panels.target.points.finest = finest;
    panels.target.points.draw();
    $("finest").textContent = finest
      ? `What is below ${finest.toFixed(1)} px stays the person's: the circle λ on the target.`
      : "";
  });
  preview.addEventListener("done", () => {
    say(`Done in ${took.toFixed(2)} s.`);
    void gallery.looks.go();
  });
  preview.addEventListener("problem", (event) => {
    const error = /** @type {CustomEvent} */ (event).detail;
    if (!(error instanceof ApiError)) throw error;
    // A view that this method does not make: its result says whether anything else is wrong.
    if (stage.tab !== "result" && error.status !== 0 && error.code !== "busy") return stage.open("result");
    const marks = ["bad_landmarks", "no_face"].includes(error.code);
    const blamed = controls.blame(error.message);
    $("points-problem").textContent = !blamed && marks ? error.message : "";
    problems.tell("work", blamed || marks ? "" : error.message);
    say(error.message);
  });

  await gallery.restore(kept?.references ?? {}, kept?.starred ?? []);
  gallery.inUse = kept?.reference ?? "";
  store.reset({ options: { ...controls.defaults, ...kept?.options }, reference: gallery.inUse });
  await take(photos);
  if (kept?.options) store.reset({ options: { ...controls.defaults, ...kept.options } });
  $("samples").disabled = false;
}

start().catch((error) => {
  $("stage-problem").textContent = error.message;
  if (!(error instanceof ApiError)) throw error;
});
