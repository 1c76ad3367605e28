/** Families of mechanisms that trace curves: the point of a body is o + p u + q v, where u is the path of a pin of that body, v its direction, and o, p, q
 * are complex numbers: place, size and turn of the mechanism, and the point. The numbers x of the linkage shape u and v; the driver runs once around in [0, 2 pi). */
import { FULL_TURN } from "../way.js";
import { arcWhere } from "./linkages.js";

/** The direction of a bar from a to the end of a second one on d: bar, rocker their lengths; false where they do not meet. `at`: where it is written. */
function barred(ax, ay, dx, dy, bar, rocker, sign, V, at) {
  const x = dx - ax, y = dy - ay, far = x * x + y * y;
  const s = (bar * bar - rocker * rocker + far) / (2 * far), rest = (bar * bar) / far - s * s;
  if (!(rest >= 0)) return false;
  const t = sign * Math.sqrt(rest);
  V[at] = (s * x - t * y) / bar;
  V[at + 1] = (s * y + t * x) / bar;
  return true;
}

/** Four lengths, the first the crank of 1, from their logarithms. */
function turned(x, tau, U, V) {
  const bar = Math.exp(x[0]), rocker = Math.exp(x[1]), ground = Math.exp(x[2]);
  if (Math.abs(ground - 1) < Math.abs(bar - rocker) || ground + 1 > bar + rocker) return false;
  for (let k = 0; k < tau.length; k += 1) {
    const c = Math.cos(tau[k]), s = Math.sin(tau[k]);
    U[2 * k] = c;
    U[2 * k + 1] = s;
    if (!barred(c, s, ground, 0, bar, rocker, 1, V, 2 * k)) return false;
  }
  return true;
}

/** Four-bars whose driven link swings between limits: both branches, one after the other. */
function swinging(x, tau, U, V) {
  const [bar, rocker, ground] = [Math.exp(x[0]), Math.exp(x[1]), Math.exp(x[2])];
  const { middle, half } = arcWhere((bar - rocker) ** 2, (bar + rocker) ** 2, 1 + ground * ground, -2 * ground);
  if (half === Math.PI || !(half > 0.05)) return false;
  for (let k = 0; k < tau.length; k += 1) {
    const turn = middle + half * (1 - 1e-9) * Math.sin(tau[k]), c = Math.cos(turn), s = Math.sin(turn);
    U[2 * k] = c;
    U[2 * k + 1] = s;
    if (!barred(c, s, ground, 0, bar, rocker, Math.cos(tau[k]) < 0 ? -1 : 1, V, 2 * k)) return false;
  }
  return true;
}

/** Slider-cranks: logarithm of the bar, height of the guide above the crank's pivot. */
function sliding(x, tau, U, V) {
  const bar = Math.exp(x[0]);
  if (Math.abs(x[1]) + 1 > bar) return false;
  for (let k = 0; k < tau.length; k += 1) {
    const c = Math.cos(tau[k]), s = Math.sin(tau[k]), sine = (x[1] - s) / bar;
    U[2 * k] = c;
    U[2 * k + 1] = s;
    V[2 * k] = Math.sqrt(1 - sine * sine);
    V[2 * k + 1] = sine;
  }
  return true;
}

/** Four-bars with a dyad more, from a point of the coupler to the ground, or to a point of the rocker; x: three logarithms, the point of the coupler,
 * the other point, logarithms of the dyad's bars. */
function dyadOn(rocking) {
  const W = new Float64Array(4);
  return (x, tau, U, V) => {
    if (!turned(x, tau, U, V)) return false;
    const [bar, rocker, ground, first, second] = [Math.exp(x[0]), Math.exp(x[1]), Math.exp(x[2]), Math.exp(x[7]), Math.exp(x[8])];
    for (let k = 0; k < tau.length; k += 1) {
      const ux = U[2 * k], uy = U[2 * k + 1], vx = V[2 * k], vy = V[2 * k + 1];
      const ex = ux + x[3] * vx - x[4] * vy, ey = uy + x[3] * vy + x[4] * vx;
      let fx = x[5], fy = x[6];
      if (rocking) {
        const px = (ux + bar * vx - ground) / rocker, py = (uy + bar * vy) / rocker;
        [fx, fy] = [ground + x[5] * px - x[6] * py, x[5] * py + x[6] * px];
      }
      if (!barred(ex, ey, fx, fy, first, second, 1, W, 0)) return false;
      U[2 * k] = ex;
      U[2 * k + 1] = ey;
      V[2 * k] = W[0];
      V[2 * k + 1] = W[1];
    }
    return true;
  };
}

/** Five-bars whose second crank turns `ratio` times as fast as the first, by gears or a belt; x: logarithms of the coupler, the rod, the ground and the second
 * crank, and the angle of this where the first is at 0. */
const geared = (ratio) => (x, tau, U, V) => {
  const [bar, rod, ground, second] = [Math.exp(x[0]), Math.exp(x[1]), Math.exp(x[2]), Math.exp(x[3])];
  for (let k = 0; k < tau.length; k += 1) {
    const c = Math.cos(tau[k]), s = Math.sin(tau[k]), turn = ratio * tau[k] + x[4];
    U[2 * k] = c;
    U[2 * k + 1] = s;
    if (!barred(c, s, ground + second * Math.cos(turn), second * Math.sin(turn), bar, rod, 1, V, 2 * k)) return false;
  }
  return true;
};

/** Between two numbers. */
const within = (low, high) => (share) => low + (high - low) * share;
/** Between two lengths, as a logarithm, more often near both ends. */
const edged = (low, high, share) => Math.log(low + (high - low) * (0.5 - 0.5 * Math.cos(Math.PI * share)));
const LOG = within(-0.6, 2), POINT = [within(-3, 4), within(-3, 3)], DYAD = [within(-0.2, 2), within(-0.2, 2)];

/** Logarithms of bar, rocker and ground for a crank of 1 that turns fully, often near where it no longer does; null where there is no such ground. */
function cranked([a, b, c]) {
  const x = [LOG(a), LOG(b)], [bar, rocker] = x.map(Math.exp), apart = Math.abs(bar - rocker);
  const short = apart < 0.95 ? [0.05, 1 - apart] : null, long = 1 + apart < bar + rocker - 1 ? [1 + apart, Math.min(bar + rocker - 1, 9)] : null;
  if (long && !(long[1] > long[0])) return null;
  if (!short) return long && [...x, edged(...long, c)];
  const share = long ? 0.3 : 1;
  return [...x, c < share ? edged(...short, c / share) : edged(...long, (c - share) / (1 - share))];
}

const each = (ranges) => (shares) => ranges.map((range, k) => range(shares[k]));
/** Numbers of a six-bar: those of its four-bar, then the rest. */
const onFourBar = (ranges) => (shares) => { const x = cranked(shares); return x && [...x, ...each(ranges)(shares.slice(3))]; };
const SWINGS = within(-1.2, 1.2);

const GEARED = each([within(0, 2), within(0, 2), within(-1.2, 1.8), within(-1.6, 0.8), within(-Math.PI, Math.PI)]);

/** Names; how many numbers, and those of shares in (0, 1), or null; how many linkages are in the atlas, and how many turns in a search; `whole` where the driver turns fully. */
export const FAMILIES = [
  { name: "four-bar", trace: turned, count: 3, numbers: cranked, share: 8, turns: 4, whole: true },
  { name: "rocker", trace: swinging, count: 3, numbers: each([SWINGS, SWINGS, SWINGS]), share: 3, turns: 1, whole: false },
  { name: "slider-crank", trace: sliding, count: 2, numbers: each([within(0.05, 2), within(0, 3)]), share: 1, turns: 1, whole: true },
  { name: "stephenson", trace: dyadOn(false), count: 9, numbers: onFourBar([...POINT, within(-5, 6), within(-5, 5), ...DYAD]), share: 2, turns: 1, whole: true },
  { name: "watt", trace: dyadOn(true), count: 9, numbers: onFourBar([...POINT, within(-4, 4), within(-4, 4), ...DYAD]), share: 2, turns: 1, whole: true },
  ...[-1, 1, -2, 2].map((ratio) => ({ name: "geared", trace: geared(ratio), count: 5, numbers: GEARED, share: 1, turns: 0.5, whole: true, ratio })),
];

/** The driver at a share of its way around, slower where crank and ground are in line: there points of nearly singular mechanisms hurry. */
export const timed = (share) => FULL_TURN * share - 0.35 * Math.sin(2 * FULL_TURN * share);
/** n values of the driver around. */
export const around = (n) => Float64Array.from({ length: n }, (_, k) => timed(k / n));
