// Closes the cracks of a mesh: where a vertex lies within an edge of another triangle, the graphics
// card leaves pixels out between the two. The triangle is split there.

const near = 1e-5;  // of the mesh's size: vertices this far from an edge lie on it

/** Vertices by cells of a grid, each position once. */
class VertexGrid {
  #cells = new Map();

  constructor(position, cell) {
    this.position = position;
    this.cell = cell;
    const seen = new Set();
    for (let v = 0; v < position.length / 3; ++v) {
      const at = this.at(v);
      const key = at.join();
      if (seen.has(key)) continue;
      seen.add(key);
      const name = at.map((x) => Math.floor(x / cell)).join();
      if (this.#cells.has(name)) this.#cells.get(name).push(v);
      else this.#cells.set(name, [v]);
    }
  }

  at(v) {
    return [...this.position.subarray(3 * v, 3 * v + 3)];
  }

  /** A vertex that lies within the edge from a to b, and how far along; null if there is none. */
  within(a, b, slack) {
    const along = b.map((x, c) => x - a[c]);
    const length = Math.hypot(...along);
    if (length < 4 * slack) return null;
    const [low, high] = [Math.min, Math.max].map(
        (pick, k) => a.map((x, c) => Math.floor((pick(x, b[c]) + (2 * k - 1) * slack) / this.cell)));
    for (let i = low[0]; i <= high[0]; ++i) {
      for (let j = low[1]; j <= high[1]; ++j) {
        for (let k = low[2]; k <= high[2]; ++k) {
          for (const v of this.#cells.get(`${i},${j},${k}`) ?? []) {
            const p = this.at(v);
            const to = p.map((x, c) => x - a[c]);
            const part = (to[0] * along[0] + to[1] * along[1] + to[2] * along[2]) / length ** 2;
            if (part * length < 2 * slack || (1 - part) * length < 2 * slack) continue;
            const off = Math.hypot(...to.map((x, c) => x - part * along[c]));
            if (off < slack) return { vertex: v, part };
          }
        }
      }
    }
    return null;
  }
}

/**
 * Splits triangles at vertices that lie within their edges.
 * @param {Float32Array} position [v][3]
 * @param {Uint32Array} triangle [t][3]
 * @returns {{triangle: number[], from: number[], added: {at: number, ends: number[],
 *   part: number}[]}} the new triangles, the old one that each is part of, and the vertices that
 *   follow the old ones: where vertex `at` is, with values between those of two earlier ones
 */
export function closeCracks(position, triangle) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < position.length; ++k) {
    low[k % 3] = Math.min(low[k % 3], position[k]);
    high[k % 3] = Math.max(high[k % 3], position[k]);
  }
  const size = Math.hypot(...high.map((x, c) => x - low[c]));
  const grid = new VertexGrid(position, size / 48);
  const added = [], splits = new Map();
  const count = position.length / 3;
  const place = (v) => grid.at(v < count ? v : added[v - count].at);

  /** The vertex that splits the edge from a to b, of the surface that both are on. */
  const split = (a, b) => {
    const key = a < b ? `${a},${b}` : `${b},${a}`;
    if (splits.has(key)) return splits.get(key);
    const found = grid.within(place(a), place(b), near * size);
    let vertex = null;
    if (found) {
      vertex = count + added.length;
      added.push({ at: found.vertex, ends: [a, b], part: found.part });
    }
    splits.set(key, vertex);
    return vertex;
  };

  const result = [], from = [], open = [];
  for (let t = 0; t < triangle.length / 3; ++t) {
    open.push([...triangle.subarray(3 * t, 3 * t + 3)]);
    while (open.length > 0) {
      const [a, b, c] = open.pop();
      const corner = [[a, b, c], [b, c, a], [c, a, b]];
      let cut = null;
      for (const [p, q, r] of corner) {
        const vertex = split(p, q);
        if (vertex === null) continue;
        cut = [[p, vertex, r], [vertex, q, r]];
        break;
      }
      if (cut) {
        open.push(...cut);
      } else {
        result.push(a, b, c);
        from.push(t);
      }
    }
  }
  return { triangle: result, from, added };
}
