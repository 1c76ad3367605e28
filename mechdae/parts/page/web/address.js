/** The address of a page: what differs from the file. */

export function writeHash({ session, data, way }) {
  if (!session.live || location.protocol === "about:") return;
  const parts = data.sliders.flatMap((slider, k) => (session.theta[k] === slider.value ? [] : [`${encodeURIComponent(slider.name)}=${session.theta[k]}`]));
  if (way !== session.way) parts.push(`drivers=${session.drivers()}`, `along=${encodeURIComponent(way.name)}`);
  else if (session.s !== data.start.s) parts.push(`s=${session.s}`);
  const own = (data.modes.find((mode) => mode.own) || {}).label;
  if (session.mode && session.mode !== own) parts.push(`mode=${encodeURIComponent(session.mode)}`);
  try { history.replaceState(null, "", parts.length ? `#${parts.join("&")}` : location.pathname + location.search); } catch { /* in a frame without address */ }
}

export function readHash({ session, data }) {
  if (!session.live || location.hash.length < 2) return;
  const given = new URLSearchParams(location.hash.slice(1).replace(/\+/g, "%2B"));
  if (given.has("mode")) session.choose(given.get("mode"));
  const theta = data.sliders.map((slider, k) => {
    const value = Number(given.get(slider.name));
    return given.has(slider.name) && Number.isFinite(value) ? value : session.theta[k];
  });
  if (theta.some((value, k) => value !== session.theta[k])) session.dimension(theta);
  const u = (given.get("drivers") || "").split(",").map(Number);
  const k = (data.drivers || []).findIndex(({ name }) => name === given.get("along"));
  if (k >= 0 && u.length === data.drivers.length && u.every(Number.isFinite)) session.move(u, k);
  const s = Number(given.get("s"));
  if (given.has("s") && Number.isFinite(s)) session.drive(s);
}
