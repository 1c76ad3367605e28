/** A drawn mechanism: links as plain data, closed by Newton's method. A preview, nothing here is certified. */
import { eliminated } from "./path.js";
import { determinant } from "./friction.js";
import { GROUND_ID } from "./model.js";
import { hull } from "./view.js";

const CLOSED = 1e-13, SHORTEST = 1e-5, FULL = 2 * Math.PI;

/** The frame of a link at the drawn place: origin at its first node, x towards its second one. Of a file that was opened with
 * the numbers that were typed there, as long as no point of the link has moved. */
export function frameOf(link, nodes) {
  const [a, b] = link.nodes.map((id) => nodes.get(id));
  const { typed } = link;
  const still = (id, k) => { const { x, y } = nodes.get(id); return id === typed.nodes[k] && x === typed.at[k][0] && y === typed.at[k][1]; };
  if (typed && typed.nodes && typed.nodes.length === link.nodes.length && link.nodes.every(still)) {
    return { origin: [a.x, a.y], angle: typed.angle, locals: new Map(link.nodes.map((id, k) => [id, typed.locals[k]])), typed: true };
  }
  const angle = Math.atan2(b.y - a.y, b.x - a.x);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const locals = new Map(link.nodes.map((id) => {
    const { x, y } = nodes.get(id);
    const [dx, dy] = [x - a.x, y - a.y];
    return [id, [c * dx + s * dy, c * dy - s * dx]];
  }));
  locals.set(link.nodes[0], [0, 0]);
  locals.set(link.nodes[1], [Math.hypot(b.x - a.x, b.y - a.y), 0]);
  return { origin: [a.x, a.y], angle, locals };
}

export class Draft {
  /** @param {any} model nodes {id, name, x, y, fixed, slide, slot, welds}, links {id, name, nodes}, bars {id, name, ends}, driver */
  constructor(model) {
    this.model = model;
    this.nodes = new Map(model.nodes.map((node) => [node.id, node]));
    this.links = model.links;
    this.frames = this.links.map((link) => frameOf(link, this.nodes));
    this.start = this.frames.flatMap(({ origin, angle }) => [...origin, angle]);
    this.index = new Map(this.links.map((link, k) => [link.id, k]));
    this.joints = this.equations();
    this.size = Math.max(1e-9, ...model.nodes.flatMap((a) => model.nodes.map((b) => Math.hypot(a.x - b.x, a.y - b.y))));
  }

  /** Where a node of a link is: place, and its derivatives by the three coordinates of that link. */
  place(q, k, id) {
    const [lx, ly] = this.frames[k].locals.get(id);
    const [c, s] = [Math.cos(q[3 * k + 2]), Math.sin(q[3 * k + 2])];
    return { k, at: [q[3 * k] + c * lx - s * ly, q[3 * k + 1] + s * lx + c * ly], turn: [-s * lx - c * ly, c * lx - s * ly] };
  }

  /** The frame of a link, or of the ground. */
  frame(id) { return id === GROUND_ID ? { angle: 0, typed: true } : this.frames[this.index.get(id)]; }

  /** How far links that are welded are turned from the first of them: as typed where none was moved, or none is placed yet. */
  turns({ links, turns, fresh }) {
    const frames = links.map((id) => this.frame(id));
    return turns && (fresh || frames.every(({ typed }) => typed)) ? turns : frames.map(({ angle }) => angle - frames[0].angle);
  }

  /** The length of a bar: as typed where no end was moved, or none is placed yet. */
  length({ ends, typed }) {
    const [a, b] = ends.map((id) => this.nodes.get(id));
    const still = typed && (!typed.at || [a, b].every(({ x, y }, k) => x === typed.at[k][0] && y === typed.at[k][1]));
    return still ? typed.length : Math.hypot(b.x - a.x, b.y - a.y);
  }

  /** What holds the links together, one entry for each joint: its name and its rows at q. */
  equations() {
    const found = [];
    const along = (one, [x, y], value) => ({ value, slopes: [[3 * one.k, x], [3 * one.k + 1, y], [3 * one.k + 2, x * one.turn[0] + y * one.turn[1]]] });
    const both = (a, b) => [0, 1].map((axis) => {
      const way = axis === 0 ? [1, 0] : [0, 1];
      const first = along(a, way, a.at[axis] - b.at[axis]);
      if (b.k !== undefined) first.slopes.push(...along(b, way, 0).slopes.map(([j, v]) => [j, -v]));
      return first;
    });
    for (const node of this.model.nodes) {
      const own = this.links.flatMap((link, k) => (link.nodes.includes(node.id) ? [k] : []));
      own.forEach((k, i) => {
        if (node.fixed) found.push({ name: node.name, rows: (q) => both(this.place(q, k, node.id), { at: [node.x, node.y] }) });
        else if (i > 0) found.push({ name: node.name, rows: (q) => both(this.place(q, k, node.id), this.place(q, own[0], node.id)) });
      });
      if (!own.length) continue;
      for (const weld of node.welds) found.push(...this.welded(node, weld));
      if (node.slide) {
        const normal = [-Math.sin(node.slide.angle), Math.cos(node.slide.angle)];
        found.push({ name: node.name, rows: (q) => {
          const { at, ...one } = this.place(q, own[0], node.id);
          return [along(one, normal, normal[0] * (at[0] - node.x) + normal[1] * (at[1] - node.y))];
        } });
      }
      if (node.slot) {
        const k = this.index.get(node.slot.link);
        found.push({ name: node.name, rows: (q) => {
          const one = this.place(q, own[0], node.id);
          const [c, s] = [Math.cos(q[3 * k + 2]), Math.sin(q[3 * k + 2])];
          const [dx, dy] = [one.at[0] - q[3 * k], one.at[1] - q[3 * k + 1]];
          const row = along(one, [-s, c], c * dy - s * dx);
          row.slopes.push([3 * k, s], [3 * k + 1, -c], [3 * k + 2, -s * dy - c * dx]);
          return [row];
        } });
      }
    }
    for (const bar of this.model.bars) found.push(this.barred(bar));
    return found;
  }

  /** Rows that keep links from turning against the first one, as lengths. */
  welded(node, weld) {
    const turns = this.turns(weld), [first, ...others] = weld.links.map((id) => (id === GROUND_ID ? null : 3 * this.index.get(id) + 2));
    return others.map((j, k) => ({ name: node.name, rows: (q) => {
      const apart = q[j] - (first === null ? 0 : q[first]) - turns[k + 1];
      const slopes = [[j, this.size], ...(first === null ? [] : [[first, -this.size]])];
      return [{ value: this.size * (apart - FULL * Math.round(apart / FULL)), slopes }];
    } }));
  }

  /** The row of a bar: its ends as far apart as it is long. */
  barred(bar) {
    const length = this.length(bar);
    const ends = bar.ends.map((id) => [this.nodes.get(id), this.links.findIndex(({ nodes }) => nodes.includes(id))]);
    return { name: bar.name, rows: (q) => {
      const [a, b] = ends.map(([node, k]) => (node.fixed || k < 0 ? { at: [node.x, node.y] } : this.place(q, k, node.id)));
      const [dx, dy] = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
      const slopes = [[a, -1], [b, 1]].flatMap(([{ k, turn }, sign]) => (k === undefined ? [] : [[3 * k, (sign * dx) / length], [3 * k + 1, (sign * dy) / length], [3 * k + 2, (sign * (dx * turn[0] + dy * turn[1])) / length]]));
      return [{ value: (dx * dx + dy * dy - length * length) / (2 * length), slopes }];
    } };
  }

  /** The driver's row: an angle, or a way along a guide. */
  driven(q, u) {
    const { driver } = this.model;
    if (driver.kind === "turn") return { value: q[3 * this.index.get(driver.link) + 2] - u, slopes: [[3 * this.index.get(driver.link) + 2, 1]] };
    const node = this.nodes.get(driver.node);
    const k = this.links.findIndex((link) => link.nodes.includes(node.id));
    const { at, turn } = this.place(q, k, node.id);
    const [x, y] = [Math.cos(node.slide.angle), Math.sin(node.slide.angle)];
    return { value: x * (at[0] - node.x) + y * (at[1] - node.y) - u, slopes: [[3 * k, x], [3 * k + 1, y], [3 * k + 2, x * turn[0] + y * turn[1]]] };
  }

  /** Value of the driver in the drawing. */
  get begin() {
    const { driver } = this.model;
    return driver && driver.kind === "turn" ? this.frames[this.index.get(driver.link)].angle : 0;
  }

  matrix(rows) {
    return rows.map(({ slopes }) => {
      const line = new Array(this.start.length).fill(0);
      for (const [j, v] of slopes) line[j] += v;
      return line;
    });
  }

  /** Mobility by count and by rank, and the joints whose equations find no pivot. */
  check() {
    const rows = [], names = [];
    for (const { name, rows: made } of this.joints) for (const row of made(this.start)) { rows.push(row); names.push(name); }
    const scaled = this.matrix(rows).map((line) => line.map((value, j) => (j % 3 === 2 ? value / this.size : value)));
    const pivots = [], without = [];
    scaled.forEach((line, i) => { // each row against those before it
      const rest = [...line];
      for (const { at, own } of pivots) {
        const share = rest[at] / own[at];
        for (let j = 0; j < rest.length; j += 1) rest[j] -= share * own[j];
      }
      const at = rest.reduce((best, value, j) => (Math.abs(value) > Math.abs(rest[best]) ? j : best), 0);
      if (Math.abs(rest[at] || 0) > 1e-9) pivots.push({ at, own: rest });
      else without.push(names[i]);
    });
    const count = this.start.length - rows.length;
    return { count, rank: this.start.length - pivots.length, without: [...new Set(without)] };
  }

  /** Close the links at a value of the driver; `square` false: only as near as they come. */
  solve(guess, u) {
    let q = [...guess];
    for (let round = 0; round < 25; round += 1) {
      const rows = [...this.joints.flatMap(({ rows: made }) => made(q)), this.driven(q, u)];
      if (rows.length !== q.length) return null;
      const worst = Math.max(...rows.map(({ value }) => Math.abs(value)));
      if (worst <= CLOSED * this.size) return { q, sign: Math.sign(determinant(this.matrix(rows))) };
      const step = eliminated(this.matrix(rows), rows.map(({ value }) => value));
      if (!step || !step.every(Number.isFinite)) return null;
      q = q.map((value, j) => value - step[j]);
      if (Math.max(...step.map((v, j) => Math.abs(v) / (j % 3 === 2 ? 1 : this.size))) > 3) return null;
      if (round > 12 && worst <= 1e-11 * this.size) return { q, sign: Math.sign(determinant(this.matrix(rows))) };
    }
    return null;
  }

  /** Poses along the driver, both ways from the drawing, as far as the links close. */
  sweep() {
    const turn = this.model.driver.kind === "turn";
    const step = turn ? FULL / 360 : this.size / 120;
    const begun = this.solve(this.start, this.begin);
    if (!begun || !begun.sign) return null;
    const first = { u: this.begin, q: begun.q };
    const reach = (sense) => {
      const list = [];
      let last = first, ds = step;
      for (let tries = 0; list.length < 360 && tries < 900; tries += 1) {
        const u = last.u + sense * ds;
        const next = this.solve(last.q, u);
        if (next && next.sign === begun.sign) {
          last = { u, q: next.q };
          list.push(last);
          ds = step;
        } else if ((ds /= 2) < SHORTEST * step) return { list, end: last };
        if (turn && Math.abs(last.u - this.begin) >= FULL - 1e-9) break;
      }
      return { list, end: null };
    };
    const ahead = reach(1);
    if (turn && !ahead.end) return { poses: [first, ...ahead.list], ends: [null, null] };
    const back = reach(-1);
    return { poses: [...back.list.reverse(), first, ...ahead.list], ends: [back.end, ahead.end] };
  }

  /** Beyond a limit: the pose with the smallest gaps, and where they are. */
  open(guess, u) {
    let q = [...guess];
    for (let round = 0; round < 60; round += 1) {
      const rows = [...this.joints.flatMap(({ rows: made }) => made(q)), this.driven(q, u)];
      rows[rows.length - 1] = { value: 1e3 * rows[rows.length - 1].value, slopes: rows[rows.length - 1].slopes.map(([j, v]) => [j, 1e3 * v]) };
      const J = this.matrix(rows);
      const normal = q.map((_, i) => q.map((__, j) => J.reduce((sum, line) => sum + line[i] * line[j], i === j ? 1e-9 : 0)));
      const step = eliminated(normal, q.map((_, i) => J.reduce((sum, line, k) => sum + line[i] * rows[k].value, 0)));
      if (!step) break;
      q = q.map((value, j) => value - step[j]);
    }
    let worst = { gap: 0, name: "" };
    for (const { name, rows: made } of this.joints) {
      const gap = Math.hypot(...made(q).map(({ value }) => value));
      if (gap > worst.gap) worst = { gap, name };
    }
    return { q, ...worst };
  }

  /** Places of the nodes of each link, as "link.node". */
  places(q) {
    const found = {};
    this.links.forEach((link, k) => { for (const id of link.nodes) found[`${link.name}.${this.nodes.get(id).name}`] = this.place(q, k, id).at; });
    const barred = new Set(this.model.bars.flatMap(({ ends }) => ends));
    for (const node of this.model.nodes) if (node.fixed || node.slide || barred.has(node.id)) found[`ground.${node.name}`] = [node.x, node.y];
    return found;
  }

  angles(q) { return Object.fromEntries(this.links.map((link, k) => [link.name, q[3 * k + 2]])); }

  /** What is drawn, put together from symbols of `draw/fragments.py`. */
  scene(symbols, q, driven) {
    const name = (id) => this.nodes.get(id).name, places = this.places(q);
    const parts = [], joints = [], letters = [], reach = {};
    const line = (id, at, paint) => parts.push({ id, at, ...paint });
    const sign = (id, at, shapes, more = {}) => parts.push({ id, at: [at], shapes, ...more });
    this.links.forEach((link) => {
      const at = link.nodes.map((id) => `${link.name}.${name(id)}`), look = symbols[driven === link.name ? "driven" : "bar"];
      const around = hull(at.map((own) => [...places[own], own]));
      if (around.length > 2) {
        line(`body-${link.name}-polygon`, around.map(([, , own]) => own), symbols.face);
        around.forEach(([, , own], k) => line(`body-${link.name}-bar`, [own, around[(k + 1) % around.length][2]], look));
      } else line(`body-${link.name}-bar`, around.map(([, , own]) => own), look);
    });
    for (const { name: own, ends } of this.model.bars) line(`joint-${own}-distance`, ends.map((id) => this.end(id)), symbols.distance);
    for (const node of this.model.nodes) {
      const own = this.links.filter((link) => link.nodes.includes(node.id));
      if (!own.length && !this.model.bars.some(({ ends }) => ends.includes(node.id))) continue;
      const here = own.length ? `${own[0].name}.${node.name}` : `ground.${node.name}`, turn = `${node.name}/axis`;
      letters.push([node.name, here]);
      if (node.fixed) sign(`support-${node.name}`, here, symbols.support);
      if (node.slide || node.slot) {
        const link = node.slot && this.links[this.index.get(node.slot.link)];
        const joint = { name: node.name, first: link ? `${link.name}.${name(link.nodes[0])}` : `ground.${node.name}`, second: here, axis: link ? 0 : node.slide.angle };
        const spans = symbols[link ? "slot" : "guide"].map((part) => ({ id: `joint-${node.name}-guide`, at: [`${node.name}/low`, `${node.name}/high`], span: true, turn, ...part }));
        joints.push(joint);
        reach[node.name] = [0, 0];
        parts.push(...spans);
        if (!link) sign(`joint-${node.name}-block`, here, symbols.block, { turn });
      }
      if (node.welds.length) sign(`joint-${node.name}-weld`, here, symbols.weld);
      else sign(`joint-${node.name}-pin`, here, own.length > 1 || node.fixed || node.slide || node.slot || !own.length ? symbols.pin : symbols.dot);
    }
    const { driver } = this.model, node = driver && driver.kind !== "turn" && this.nodes.get(driver.node);
    const link = driver && driver.kind === "turn" && this.links.find(({ id }) => id === driver.link);
    const pivot = link && (link.nodes.find((id) => this.nodes.get(id).fixed) ?? link.nodes[0]);
    if (node && this.links.some(({ nodes }) => nodes.includes(node.id))) sign("driver", this.end(node.id), symbols.travel, { turn: `${node.name}/axis` });
    if (link) {
      const [a, b] = [pivot, link.nodes.find((id) => id !== pivot)].map((id) => `${link.name}.${name(id)}`);
      sign("driver", a, symbols.arrow, { turn: `${a}>${b}` });
    }
    const text = (own, size) => ["text", "ink", 0, 0, size, own, size > 9, "middle"];
    for (const [own, here] of letters) { // on the side where no link leaves
      const arms = this.links.flatMap(({ name: body, nodes }) => (nodes.some((id) => name(id) === own) ? nodes.map((id) => places[`${body}.${name(id)}`]) : []));
      const away = arms.reduce(([x, y], [u, v]) => [x - u + places[here][0], y - v + places[here][1]], [0, 0]), size = Math.hypot(...away);
      const fixed = parts.some(({ id }) => id === `support-${own}`); // its ground is below
      const [x, y] = fixed ? [away[0] > 0 ? 16 : -16, 4] : size > 0 ? away.map((v) => (15 * v) / size) : [-9, 12];
      sign(`label-${own}`, here, [text(own, 14)], { spot: [0, x, -y] });
    }
    this.links.forEach((own, k) => {
      const at = own.nodes.map((id) => `${own.name}.${name(id)}`);
      const plate = parts.some(({ id }) => id === `body-${own.name}-polygon`);
      parts.push({ id: `number-${own.name}`, at, turn: own.name, spot: [0, 0, plate ? 0 : 12], shapes: [symbols.disc, text(String(k + 1), 9)] });
    });
    return { scene: { joints }, drawing: { parts, reach, loads: {} } };
  }

  /** The point of a node, of a link or of the ground. */
  end(id) {
    const node = this.nodes.get(id), own = this.links.find(({ nodes }) => nodes.includes(id));
    return `${node.fixed || !own ? "ground" : own.name}.${node.name}`;
  }
}
