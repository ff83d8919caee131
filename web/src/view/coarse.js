// A coarser copy of a mesh for browsers that draw slowly: vertices of one cell of a grid become their mean.

/** mesh: {positions (3n), faces (3m)}, mm; another such mesh, with the triangles that are left. cell: mm. */
export function coarser({ positions, faces }, cell) {
  const cells = new Map();
  const sums = []; // x, y, z and how many, of each cell
  const cellOf = new Uint32Array(positions.length / 3);
  for (let vertex = 0; vertex < cellOf.length; vertex += 1) {
    const at = positions.subarray(3 * vertex, 3 * vertex + 3);
    const key = at.map((x) => Math.round(x / cell)).join();
    if (!cells.has(key)) cells.set(key, sums.push([0, 0, 0, 0]) - 1);
    const own = (cellOf[vertex] = cells.get(key));
    at.forEach((x, axis) => (sums[own][axis] += x));
    sums[own][3] += 1;
  }
  const left = [];
  for (let k = 0; k < faces.length; k += 3) {
    const [a, b, c] = [cellOf[faces[k]], cellOf[faces[k + 1]], cellOf[faces[k + 2]]];
    if (a !== b && b !== c && c !== a) left.push(a, b, c);
  }
  return { positions: Float32Array.from(sums.flatMap(([x, y, z, n]) => [x / n, y / n, z / n])), faces: Uint32Array.from(left) };
}
