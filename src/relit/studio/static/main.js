// @ts-check
/** The page: what the visitor does becomes the document, and the document is shown. */

import { ApiError, fetchOptions } from "./api.js";
import { Controls } from "./controls.js";
import { dropZone, save } from "./files.js";
import { Intake } from "./intake.js";
import { Panel } from "./panel.js";
import { ROLES } from "./pairs.js";
import { PointTools } from "./tools.js";
import { Preview } from "./preview.js";
import { Stage } from "./stage.js";
import { Store } from "./state.js";
import { Sync } from "./sync.js";
import { begin, keep } from "./visit.js";

/**
 * @typedef {import("./api.js").Role} Role
 * @typedef {{faces: import("./pairs.js").Faces, options: Record<string, any>}} Document
 */

const SIDE = 1600; // px of a photo that is shown for its landmarks

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const say = (/** @type {string} */ text) => ($("status").textContent = text);

async function start() {
  /** @type {(files: File[]) => void} */
  let drop = () => {};
  dropZone(document.documentElement, (files) => drop(files));
  const offer = await fetchOptions();
  const { session, photos, kept } = await begin();
  /** @type {Record<Role, string>} */
  let names = kept?.names ?? { target: "", reference: "" };
  let took = 0;

  const controls = new Controls(offer.options, $("first"), $("more"));
  /** @type {Store<Document>} */
  const store = new Store({ faces: { target: null, reference: null }, options: controls.defaults });
  const sync = new Sync(session);
  const stage = new Stage($("stage"));
  const panels = /** @type {Record<Role, Panel>} */ (
    Object.fromEntries(ROLES.map((role) => [role, new Panel(role, $("photo"), offer.landmark_formats)]))
  );
  for (const role of ROLES) $("pair").append(panels[role].root);
  const tools = new PointTools(store, panels, say);
  const preview = new Preview(
    (request, signal) => session.render(request, signal),
    () => sync.push(() => store.now.faces),
  );

  const note = () => keep({ session: session.token, names, options: store.now.options });

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
    if (able) preview.ask({ options: store.now.options, views: stage.wanted, side: stage.side });
    else preview.cancel();
    $("stage").classList.toggle("waiting", !able);
    if (!able && photos.target) say("The preview waits for photos and landmarks.");
  };

  /** @param {Role} role @param {import("./api.js").Photo} photo */
  const showPhoto = async (role, photo) => {
    photos[role] = photo;
    const blob = await session.picture(role, SIDE);
    panels[role].show(blob, photo, names[role]);
    panels[role].problem(photo.message ?? "");
    if (role === "target") stage.before(blob, photo);
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
    store.reset({ faces: { ...store.now.faces, ...faces } });
    note();
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
      if (role) panels[role].problem("");
      else $("stage-problem").textContent = "";
      await act();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (role) panels[role].problem(error.message);
      else $("stage-problem").textContent = error.message;
    } finally {
      clearTimeout(slow);
      for (const panel of busy) panel.busy(false);
      if ($("status").textContent === doing) say("");
    }
  };

  const intake = new Intake(session, offer, attempt, {
    photos: (given, called) => {
      names = { ...names, ...called };
      return take(given);
    },
    marks: (role, marks) => {
      sync.knows(role, { target: null, reference: null, [role]: marks });
      store.set({ faces: { ...store.now.faces, [role]: marks } });
    },
  });
  drop = (files) => {
    const empty = ROLES.find((role) => !photos[role]);
    if (empty || files.length > 1) void intake.receive(files, empty ?? "target");
    else say("Drop a single file on the target or on the reference.");
  };

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
      names = { target: "sample", reference: "sample" };
      await take(given);
    }),
  );
  $("swap").addEventListener("click", () =>
    attempt(null, async () => {
      await sync.push(() => store.now.faces);
      const given = await session.swap();
      names = { target: names.reference, reference: names.target };
      sync.held = { target: sync.held.reference, reference: sync.held.target };
      for (const role of ROLES) await showPhoto(role, given[role]);
      store.map((one) => ({ ...one, faces: { target: one.faces.reference, reference: one.faces.target } }));
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
      save(await session.export({ options: store.now.options, format: $("format").value }), "relit.zip");
      say("Exported relit.zip.");
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
  $("reset").addEventListener("click", () => store.set({ options: controls.defaults }));

  store.addEventListener("change", (event) => {
    const { before } = /** @type {CustomEvent<{before: Document}>} */ (event).detail;
    if (before.options !== store.now.options) {
      controls.show(store.now.options);
      note();
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
    $("stage-problem").textContent = $("points-problem").textContent = "";
    stage.show(picture);
    const { finest, seconds } = picture;
    took = seconds;
    panels.target.points.finest = finest;
    panels.target.points.draw();
    $("finest").textContent = finest
      ? `What is below ${finest.toFixed(1)} px stays the person's: the circle λ on the target.`
      : "";
  });
  preview.addEventListener("done", () => say(`Done in ${took.toFixed(2)} s.`));
  preview.addEventListener("problem", (event) => {
    const error = /** @type {CustomEvent} */ (event).detail;
    if (!(error instanceof ApiError)) throw error;
    // A view that this method does not make: its result says whether anything else is wrong.
    if (stage.tab !== "result" && error.status !== 0 && error.code !== "busy") return stage.open("result");
    const marks = ["bad_landmarks", "no_face"].includes(error.code);
    const place = controls.blame(error.message) ? null : marks ? "points-problem" : "stage-problem";
    for (const id of ["points-problem", "stage-problem"]) $(id).textContent = id === place ? error.message : "";
    say(error.message);
  });

  // What lambda means, under the first option, which it is.
  $("first").firstElementChild?.append($("finest"));
  store.reset({ options: { ...controls.defaults, ...kept?.options } });
  await take(photos);
  $("samples").disabled = false;
}

start().catch((error) => {
  $("stage-problem").textContent = error.message;
  if (!(error instanceof ApiError)) throw error;
});
