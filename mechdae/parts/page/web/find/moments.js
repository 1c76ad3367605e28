/** Numbers of the shape of a closed curve that do not depend on place, size, turn, start and direction: products of its complex moments by length of arc. */

export const NUMBERS = 16;
/** From here on they change sign in a mirror. */
export const MIRRORED = 12;

/** Write the numbers of a closed polyline (x, y, x, y, ...) to `found` at `at`; false of a curve of no size. */
export function momentsOf(z, n, found, at, lengths) {
  let [whole, cx, cy, area] = [0, 0, 0, 0];
  let [px, py] = [z[2 * n - 2], z[2 * n - 1]];
  for (let k = 0; k < n; k += 1) {
    const x = z[2 * k], y = z[2 * k + 1], dx = x - px, dy = y - py, long = Math.sqrt(dx * dx + dy * dy);
    lengths[k] = long;
    whole += long;
    cx += long * (x + px);
    cy += long * (y + py);
    area += px * y - x * py;
    px = x; py = y;
  }
  if (!(whole > 0)) return false;
  cx /= 2 * whole; cy /= 2 * whole;
  let [m11, ax, ay, bx, by, tx, ty, dx, dy, ex, ey, m22] = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
  lengths[n] = lengths[0];
  for (let k = 0; k < n; k += 1) {
    const w = lengths[k] + lengths[k + 1], x = z[2 * k] - cx, y = z[2 * k + 1] - cy;
    const r = w * (x * x + y * y), sx = w * (x * x - y * y), sy = 2 * w * x * y;
    m11 += r;
    ax += sx; ay += sy; // z^2
    bx += r * x; by += r * y; // z |z|^2
    tx += sx * x - sy * y; ty += sx * y + sy * x; // z^3
    const q = r / w, px2 = sx / w, py2 = sy / w;
    dx += sx * q; dy += sy * q; // z^2 |z|^2
    ex += sx * px2 - sy * py2; ey += sx * py2 + sy * px2; // z^4
    m22 += r * q;
  }
  const total = 2 * whole, size2 = m11 / total;
  if (!(size2 > 0)) return false;
  const size = Math.sqrt(size2), two = 1 / (total * size2), three = two / size, four = two / size2;
  ax *= two; ay *= two; bx *= three; by *= three; tx *= three; ty *= three; dx *= four; dy *= four; ex *= four; ey *= four;
  const a = Math.sqrt(ax * ax + ay * ay), b = Math.sqrt(bx * bx + by * by), t = Math.sqrt(tx * tx + ty * ty);
  found[at] = 2 * a;
  found[at + 1] = 2 * b;
  found[at + 2] = 2 * t;
  found[at + 3] = Math.sqrt(dx * dx + dy * dy);
  found[at + 4] = Math.sqrt(ex * ex + ey * ey);
  found[at + 5] = m22 * four;
  found[at + 6] = whole / (4 * size);
  found[at + 7] = Math.abs(area) / (4 * size2);
  const bbx = bx * bx - by * by, bby = 2 * bx * by, aax = ax * ax - ay * ay, aay = 2 * ax * ay; // each by a root of its size, so that small ones are seen
  const k = 1 / Math.sqrt(a * b + 1e-3);
  found[at + 8] = 2 * k * (bbx * ax + bby * ay);
  found[at + 12] = 2 * k * (bby * ax - bbx * ay);
  const abx = ax * bx - ay * by, aby = ax * by + ay * bx;
  found[at + 9] = 2 * k * (tx * abx + ty * aby);
  found[at + 13] = 2 * k * (ty * abx - tx * aby);
  found[at + 10] = dx * ax + dy * ay;
  found[at + 14] = dy * ax - dx * ay;
  found[at + 11] = ex * aax + ey * aay;
  found[at + 15] = ey * aax - ex * aay;
  return true;
}
