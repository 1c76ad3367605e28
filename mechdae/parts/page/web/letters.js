/** Where letters of pins stand: beside all links and other letters, as long as possible where they were. */

const TALL = 12, PIN = 7;
const WAYS = 16;
const RINGS = [0, 7, 15, 26];

/** Pixels that a text takes at most. */
const wide = (text) => [...text].reduce((sum, own) => sum + (/[\s,.'ijl1]/.test(own) ? 5 : /[MWmwЖШЩЮжшщю]/.test(own) ? 16 : /[A-ZА-Я]/.test(own) ? 12 : 8.5), 0);

/** How much of a stroke lies inside of a box [left, right, low, high]. */
function inside([[x, y], [u, v]], [left, right, low, high]) {
  // most are far away: this is asked thousands of times in a picture
  if ((x <= left && u <= left) || (x >= right && u >= right) || (y <= low && v <= low) || (y >= high && v >= high)) return 0;
  let from = 0, to = 1;
  if (u !== x) {
    const a = (left - x) / (u - x), b = (right - x) / (u - x);
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
  }
  if (v !== y) {
    const a = (low - y) / (v - y), b = (high - y) / (v - y);
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
  }
  return to > from ? (to - from) * Math.hypot(u - x, v - y) + 1 : 0;
}

/** Whether a point lies inside of a plate. */
function within([x, y], corners) {
  let odd = false;
  corners.forEach(([a, b], k) => {
    const [c, d] = corners[(k + corners.length - 1) % corners.length];
    if (b > y !== d > y && x < ((c - a) * (y - b)) / (d - b) + a) odd = !odd;
  });
  return odd;
}

export class Letters {
  constructor() {
    /** The way from its pin that each letter went last. */
    this.ways = new Map();
  }

  /**
   * Centres of letters [{text, x, y}] in a picture that shun strokes, plates, discs [x, y, radius] and each other.
   * A letter stays on its side while that is free.
   */
  centres(letters, strokes, plates, discs, [width, height]) {
    const boxes = discs.map(([x, y, r]) => [x - r, x + r, y - r, y + r]);
    return letters.map(({ text, x, y }) => {
      const [w, h] = [wide(text) / 2 + 1, TALL / 2];
      const before = this.ways.get(text) ?? 2;
      let best = null;
      for (let ring = 0; ring < RINGS.length && !(best && best.cost < 1); ring += 1) {
        for (let turn = 0; turn < WAYS; turn += 1) {
          // from the side where it was to both sides of it
          const off = turn % 2 ? (turn + 1) / 2 : -turn / 2;
          const way = (before + off + WAYS) % WAYS;
          const angle = (2 * Math.PI * way) / WAYS;
          const [c, s] = [Math.cos(angle), -Math.sin(angle)];
          const out = PIN + RINGS[ring] + Math.min(w / Math.max(Math.abs(c), 1e-9), h / Math.max(Math.abs(s), 1e-9));
          const centre = [x + out * c, y + out * s];
          const box = [centre[0] - w, centre[0] + w, centre[1] - h, centre[1] + h];
          let cost = 0.02 * Math.abs(off) + 0.1 * ring;
          if (box[0] < 2 || box[1] > width - 2 || box[2] < 2 || box[3] > height - 2) cost += 100;
          for (const stroke of strokes) cost += 4 * inside(stroke, box);
          for (const plate of plates) if (within(centre, plate)) cost += 30;
          for (const other of boxes) {
            const across = Math.min(box[1], other[1]) - Math.max(box[0], other[0]);
            const up = Math.min(box[3], other[3]) - Math.max(box[2], other[2]);
            if (across > 0 && up > 0) cost += 5 + across * up;
          }
          if (!best || cost < best.cost) best = { cost, centre, box, way };
          if (cost < 0.01) break;
        }
      }
      this.ways.set(text, best.way);
      // long ones stay inside where nothing else is free
      const kept = [[w, width], [h, height]].map(([half, size], axis) => Math.max(Math.min(best.centre[axis], size - half - 2), half + 2));
      boxes.push([kept[0] - w, kept[0] + w, kept[1] - h, kept[1] + h]);
      return kept;
    });
  }
}
