// Cuts a mesh by planes z = constant into closed outlines, fast enough to follow the tip: triangles are sorted into
// slabs once, and a cut looks only at those of its slab.

const SLAB = 1; // mm

export class Slicer {
  /** mesh: {positions (3n), faces (3m)}, mm. */
  constructor({ positions, faces }) {
    Object.assign(this, { positions, faces, slabs: new Map() });
    for (let face = 0; face < faces.length / 3; face += 1) this.sort(face);
  }

  z(face, corner) {
    return this.positions[3 * this.faces[3 * face + corner] + 2];
  }

  sort(face) {
    const heights = [0, 1, 2].map((corner) => this.z(face, corner));
    const last = Math.floor(Math.max(...heights) / SLAB);
    for (let slab = Math.floor(Math.min(...heights) / SLAB); slab <= last; slab += 1) {
      if (!this.slabs.has(slab)) this.slabs.set(slab, []);
      this.slabs.get(slab).push(face);
    }
  }

  /** Outlines at the height z: a list of loops, each a list of [x, y] in mm; open ends are left open. */
  cut(z) {
    const links = new Map(); // edge -> the edges that share a triangle with it
    const points = new Map();
    for (const face of this.slabs.get(Math.floor(z / SLAB)) ?? []) this.cross(face, z, links, points);
    return loops(links, points);
  }

  cross(face, z, links, points) {
    const ends = [];
    for (let corner = 0; corner < 3; corner += 1) {
      const a = this.faces[3 * face + corner];
      const b = this.faces[3 * face + ((corner + 1) % 3)];
      if (this.isBelow(a, z) !== this.isBelow(b, z)) ends.push(this.meet(Math.min(a, b), Math.max(a, b), z, points));
    }
    if (ends.length === 2) {
      link(links, ends[0], ends[1]);
      link(links, ends[1], ends[0]);
    }
  }

  /** A vertex in the plane counts as above it, so that every cut goes through edges only. */
  isBelow(vertex, z) {
    return this.positions[3 * vertex + 2] < z;
  }

  meet(a, b, z, points) {
    const key = `${a}-${b}`;
    if (!points.has(key)) points.set(key, this.between(a, b, z));
    return key;
  }

  between(a, b, z) {
    const p = this.positions;
    const share = (z - p[3 * a + 2]) / (p[3 * b + 2] - p[3 * a + 2]);
    return [0, 1].map((axis) => p[3 * a + axis] + share * (p[3 * b + axis] - p[3 * a + axis]));
  }
}

function link(links, from, to) {
  const known = links.get(from);
  if (known) known.push(to);
  else links.set(from, [to]);
}

function loops(links, points) {
  const left = new Set(links.keys());
  const outlines = [];
  for (const start of links.keys()) {
    if (left.has(start)) outlines.push(walk(start, links, left).map((key) => points.get(key)));
  }
  return outlines;
}

function walk(start, links, left) {
  const path = [];
  for (let at = start; at !== undefined; at = links.get(at).find((next) => left.has(next))) {
    left.delete(at);
    path.push(at);
  }
  return path;
}
