// Binary STL to joined triangles: vertices that coincide become one, so that shading is smooth and slices close.

const HEADER = 80;
const RECORD = 50;

/** Reads a binary STL in metres. Returns {positions (3n) in mm, faces (3m)}; throws where the file is cut or no STL. */
export function readStl(buffer) {
  const data = new DataView(buffer);
  const count = buffer.byteLength >= HEADER + 4 ? data.getUint32(HEADER, true) : -1;
  if (count < 0 || buffer.byteLength < HEADER + 4 + RECORD * count) throw new Error("not a complete binary STL");
  const found = new Map();
  const positions = [];
  const faces = new Uint32Array(3 * count);
  for (let corner = 0; corner < 3 * count; corner += 1) {
    const at = HEADER + 4 + RECORD * Math.floor(corner / 3) + 12 + 12 * (corner % 3);
    faces[corner] = joined(data, at, found, positions);
  }
  return { positions: new Float32Array(positions), faces };
}

/** The number of the vertex at byte `at`; metres to millimetres, joined within 0.1 micrometre. */
function joined(data, at, found, positions) {
  const point = [0, 4, 8].map((offset) => Math.round(1e7 * data.getFloat32(at + offset, true)) / 1e4);
  const key = point.join(",");
  const known = found.get(key);
  if (known !== undefined) return known;
  const index = positions.length / 3;
  positions.push(...point);
  found.set(key, index);
  return index;
}
