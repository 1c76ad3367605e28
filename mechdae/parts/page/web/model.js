/** The drawing as plain data, and what can be done to it; each change is one entry of undo. */

/** What stands for the ground among links that are welded. */
export const GROUND_ID = 0;

/** A name that is free: A, B, ..., Z, A1, ... */
function letterFor(taken) {
  for (let k = 0; ; k += 1) {
    const name = String.fromCharCode(65 + (k % 26)) + (k < 26 ? "" : Math.floor(k / 26));
    if (!taken.includes(name)) return name;
  }
}

export class Model {
  /** @param {any} given nodes, links, bars, driver; null for an empty drawing */
  constructor(given) {
    this.now = JSON.stringify(given || { nodes: [], links: [], bars: [], driver: null });
    this.before = [];
    this.after = [];
    this.load();
  }

  load() {
    this.data = JSON.parse(this.now);
    this.node = new Map(this.data.nodes.map((node) => [node.id, node]));
  }

  /** End a gesture: what it changed is one entry of undo. */
  done() {
    this.tidy();
    const next = JSON.stringify(this.data);
    if (next === this.now) return;
    this.before.push(this.now);
    this.after = [];
    this.now = next;
    this.load();
  }

  /** Forget what a gesture has changed so far. */
  cancel() { this.load(); }

  undo(back) {
    const [from, to] = back ? [this.before, this.after] : [this.after, this.before];
    if (!from.length) return false;
    to.push(this.now);
    this.now = from.pop();
    this.load();
    return true;
  }

  free() { return 1 + Math.max(0, ...[this.data.nodes, this.data.links, this.data.bars].flat().map(({ id }) => id)); }

  addNode(x, y) {
    const node = { id: this.free(), name: letterFor(this.data.nodes.map(({ name }) => name)), x, y, fixed: false, slide: null, slot: null, welds: [] };
    this.data.nodes.push(node);
    this.node.set(node.id, node);
    return node.id;
  }

  addLink(nodes) {
    const same = this.data.links.find((link) => nodes.every((id) => link.nodes.includes(id)));
    if (same || nodes[0] === nodes[1]) return null;
    let k = 1;
    while (this.data.links.some(({ name }) => name === `link${k}`)) k += 1;
    const link = { id: this.free(), name: `link${k}`, nodes };
    this.data.links.push(link);
    return link.id;
  }

  /** A bar of constant length between two points; again, and it is gone. */
  addBar(a, b) {
    if (a === b || this.data.links.some(({ nodes }) => nodes.includes(a) && nodes.includes(b))) return;
    const known = this.data.bars.findIndex(({ ends }) => ends.includes(a) && ends.includes(b));
    if (known >= 0) { this.data.bars.splice(known, 1); return; }
    let k = 1;
    while (this.data.bars.some(({ name }) => name === `bar${k}`)) k += 1;
    this.data.bars.push({ id: this.free(), name: `bar${k}`, ends: [a, b] });
  }

  /** Let the links of a point turn together, one fixed to the ground with the ground; again, and they are free. */
  weld(id) {
    const node = this.node.get(id), own = this.data.links.filter(({ nodes }) => nodes.includes(id)).map((link) => link.id);
    const links = node.fixed ? [GROUND_ID, ...own] : own;
    if (node.welds.length) node.welds = [];
    else if (links.length > 1) node.welds = [{ links }];
    else return false;
    return true;
  }

  link(id) { return this.data.links.find((own) => own.id === id); }

  pivot(id) { const node = this.node.get(id); node.fixed = !node.fixed; node.slide = null; node.slot = null; node.welds = []; }

  slider(id, angle = 0) { const node = this.node.get(id); node.slide = node.slide && node.slide.angle === angle ? null : { angle }; node.fixed = false; node.slot = null; }

  slot(id, link) {
    const node = this.node.get(id);
    if (this.link(link).nodes.includes(id)) return false;
    node.slot = node.slot && node.slot.link === link ? null : { link };
    node.fixed = false;
    node.slide = null;
    this.ontoSlots();
    return true;
  }

  /** Points in slots stay on the line of the link they slide along. */
  ontoSlots() {
    for (const node of this.data.nodes) {
      const link = node.slot && this.link(node.slot.link);
      if (!link) continue;
      const [a, b] = link.nodes.map((id) => this.node.get(id));
      const [dx, dy] = [b.x - a.x, b.y - a.y];
      const t = ((node.x - a.x) * dx + (node.y - a.y) * dy) / (dx * dx + dy * dy || 1);
      [node.x, node.y] = [a.x + t * dx, a.y + t * dy];
    }
  }

  /** Drive the link that turns about a fixed point, or a point along its guide. */
  drive({ node, link }) {
    const { driver } = this.data;
    const at = node === undefined ? null : this.node.get(node);
    if (at && at.slide) this.data.driver = driver && driver.node === node ? null : { kind: "slide", node };
    else {
      const own = link ?? (this.data.links.find(({ nodes }) => nodes.includes(node)) || {}).id;
      if (own === undefined) return false;
      this.data.driver = driver && driver.link === own ? null : { kind: "turn", link: own };
    }
    return true;
  }

  move(id, x, y) {
    const node = this.node.get(id);
    [node.x, node.y] = [x, y];
    this.ontoSlots();
  }

  /** Put one node in the place of another: joints become one. */
  merge(id, into) {
    const [one, other] = [this.node.get(id), this.node.get(into)];
    other.fixed = other.fixed || one.fixed;
    other.slide = other.fixed ? null : other.slide || one.slide;
    other.slot = other.fixed || other.slide ? null : other.slot || one.slot;
    for (const link of this.data.links) link.nodes = [...new Set(link.nodes.map((own) => (own === id ? into : own)))];
    for (const bar of this.data.bars) bar.ends = bar.ends.map((own) => (own === id ? into : own));
    other.welds.push(...one.welds.filter(({ links }) => !other.welds.some((own) => own.links.some((link) => links.includes(link)))));
    this.data.nodes = this.data.nodes.filter((node) => node.id !== id);
    if (this.data.driver && this.data.driver.node === id) this.data.driver.node = into;
  }

  remove({ node, link, bar }) {
    if (bar !== undefined) this.data.bars = this.data.bars.filter((own) => own.id !== bar);
    if (link !== undefined) this.data.links = this.data.links.filter((own) => own.id !== link);
    if (node !== undefined) {
      this.data.nodes = this.data.nodes.filter((own) => own.id !== node);
      for (const own of this.data.links) own.nodes = own.nodes.filter((id) => id !== node);
    }
  }

  /** Drop what hangs on nothing: links of one point, points of none, drivers and slots of what is gone. */
  tidy() {
    const { data } = this;
    data.links = data.links.filter(({ nodes }) => nodes.length > 1);
    const known = new Set(data.links.map(({ id }) => id));
    const linked = (id) => data.links.some(({ nodes }) => nodes.includes(id));
    data.nodes = data.nodes.filter((node) => node.fixed || node.slide || linked(node.id));
    const there = new Set(data.nodes.map(({ id }) => id));
    data.bars = data.bars.filter(({ ends: [a, b] }) => a !== b && there.has(a) && there.has(b) && (linked(a) || linked(b)));
    for (const node of data.nodes) {
      const holds = (id) => (id === GROUND_ID ? node.fixed : known.has(id) && this.link(id).nodes.includes(node.id));
      const welds = node.welds.map((own) => (own.links.every(holds) ? own : { links: own.links.filter(holds) })).filter(({ links }) => links.length > 1);
      if (welds.length !== node.welds.length || welds.some((own, k) => own !== node.welds[k])) node.welds = welds;
    }
    for (const node of data.nodes) if (node.slot && !known.has(node.slot.link)) node.slot = null;
    const { driver } = data;
    if (driver && !(driver.kind === "turn" ? known.has(driver.link) : data.nodes.some(({ id, slide }) => id === driver.node && slide))) data.driver = null;
  }
}
