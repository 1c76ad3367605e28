/** `window.mechdae`: the page for other programs. */
import { bareAngle } from "./session.js";
import { words } from "./words.js";

/** The interface for embedding and tests. */
export function interfaceOf(app) {
  const { data } = app;
  const own = {
    reason: "",
    get live() { return app.live; },
    ready: Promise.resolve(true),
    pose() {
      const { session } = app, { pose } = session, driver = { [app.way.name]: session.value };
      const result = { driver, status: pose.status, mode: session.mode, bound: null, points: {}, bodies: {}, joints: {}, efforts: {} };
      if (!session.live) {
        for (const [name, position] of Object.entries(app.now())) result.points[name] = { position };
        return result;
      }
      if (data.drivers) session.drivers().forEach((value, k) => { driver[data.drivers[k].name] = value; });
      result.bound = session.motion.bound(pose);
      if (!pose.y) return result;
      for (const entry of data.entries) {
        const table = (result[entry.kind][entry.part] ||= {});
        entry.names.slice(0, bareAngle(entry) ? 1 : 3).forEach((name, order) => {
          const found = session.told(pose, entry, order);
          table[name] = found && found.length === 1 ? found[0] : found;
        });
      }
      const forces = session.forcesAt(pose);
      if (forces) {
        if (forces.status !== "ok") result.status = forces.status;
        result.efforts = forces.efforts;
        for (const [name, reaction] of Object.entries(forces.reactions)) Object.assign((result.joints[name] = result.joints[name] || {}), { reaction });
        for (const [name, loss] of Object.entries(forces.losses)) result.joints[name].loss = loss;
      }
      return result;
    },
    set(values) {
      const { session } = app;
      if (!session.live) { own.reason = app.reason; return false; }
      session.settle();
      const theta = [...session.theta];
      let s = null, moved = null;
      const names = (data.drivers || []).map((own) => own.name);
      for (const [name, value] of Object.entries(values)) {
        const k = data.sliders.findIndex((slider) => slider.name === name);
        if (typeof value !== "number" || !Number.isFinite(value)) { own.reason = `${name} ${words("nonumber")}`; return false; }
        if (names.includes(name)) (moved = moved || {})[names.indexOf(name)] = value;
        else if (name === app.way.name) s = value;
        else if (k >= 0) theta[k] = value;
        else { own.reason = `${words("noname")} ${name}`; return false; }
      }
      const before = session.now();
      let ok = true;
      if (theta.some((value, k) => value !== session.theta[k])) ok = session.dimension(theta) === 1;
      own.reason = session.reason;
      if (ok && moved) { ok = session.move(session.drivers().map((value, i) => moved[i] ?? value), Number(Object.keys(moved)[0])) === 1; own.reason = session.reason; }
      if (ok && s !== null) { ok = session.drive(s); own.reason = session.reason; }
      if (!ok) { const { reason } = own; session.restore(before); own.reason = reason; }
      app.drawAll();
      return ok;
    },
    sweep(path, count = 361) {
      const { session } = app;
      if (!session.live) return [];
      session.settle();
      const output = session.output(path);
      const [low, high] = session.range;
      return Array.from({ length: count }, (_, k) => {
        const pose = session.motion.pose(count > 1 ? low + ((high - low) * k) / (count - 1) : low);
        if (!output.whole) return output.scalar(pose);
        const found = output.of(pose);
        return found && found.length === 1 ? found[0] : found;
      });
    },
    limits() {
      app.session.settle();
      return app.session.motion.ends.map((end) => (end && end.kind === "limit" ? end.s : null));
    },
    modes() { return app.session.live ? data.modes.map((mode) => mode.label) : []; },
    choose(label) {
      if (!app.session.live) { own.reason = app.reason; return false; }
      const ok = app.choose(label);
      own.reason = ok ? "" : app.session.reason;
      return ok;
    },
    toml() { return app.toml(); },
    /** Frames a second of those that were played last. */
    frames() { return app.frames; },
    /** The direction a spatial mechanism is seen from [deg]; null in the plane. */
    view() { return data.scene.space ? { azimuth: app.diagram.view.azimuth, elevation: app.diagram.view.elevation } : null; },
  };
  return own;
}
