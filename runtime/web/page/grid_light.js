// The light of a LightProbeGridWebGL where its shader would find it, read back from its texture.

import { subVolumes } from '../library/probe_grid.js';

const floats = 4 * subVolumes;  // of a probe, the last is unused

/** Irradiance of a grid at fixed points. */
export class GridLight {
  #corners = [];  // of each point: probes around and their weights, 8 each
  #basis = [];    // of each point: what harmonics of degree 0 to 2 weigh there
  #count;

  /**
   * @param {LightProbeGridWebGL} grid
   * @param {number[][]} positions [points] in metres
   * @param {number[][]} normals [points], unit
   */
  constructor(grid, positions, normals) {
    this.#count = positions.length;
    const size = grid.resolution.toArray();
    const low = grid.boundingBox.min.toArray(), high = grid.boundingBox.max.toArray();
    positions.forEach((position, p) => {
      const normal = normals[p];
      const places = size.map((count, c) => {
        const range = high[c] - low[c];
        // Half a cell off the surface, and not beyond the outermost probes.
        const at = (position[c] + 0.5 * normal[c] * range / count - low[c]) / range;
        const place = Math.min(Math.max(at * count, 0.5), count - 0.5) - 0.5;
        const first = Math.min(Math.floor(place), count - 1);
        return { first, second: Math.min(first + 1, count - 1), part: place - first };
      });
      for (let corner = 0; corner < 8; ++corner) {
        let weight = 1;
        const [x, y, z] = places.map(({ first, second, part }, c) => {
          const far = (corner >> c) & 1;
          weight *= far ? part : 1 - part;
          return far ? second : first;
        });
        this.#corners.push({ probe: x + size[0] * (y + size[1] * z), weight });
      }
      const [x, y, z] = normal;
      this.#basis.push([
        0.886227, 2 * 0.511664 * y, 2 * 0.511664 * z, 2 * 0.511664 * x, 2 * 0.429043 * x * y,
        2 * 0.429043 * y * z, 0.743125 * z * z - 0.247708, 2 * 0.429043 * x * z,
        0.429043 * (x * x - y * y),
      ]);
    });
  }

  /** The light of the grid as it is: [points][3], lx. */
  read(renderer, grid) {
    const probes = readProbes(renderer, grid);
    const result = new Float32Array(3 * this.#count);
    const sum = new Float64Array(floats);
    for (let p = 0; p < this.#count; ++p) {
      sum.fill(0);
      for (let corner = 8 * p; corner < 8 * p + 8; ++corner) {
        const { probe, weight } = this.#corners[corner];
        for (let k = 0; k < floats; ++k) sum[k] += weight * probes[floats * probe + k];
      }
      const basis = this.#basis[p];
      for (let c = 0; c < 3; ++c) {
        let light = 0;
        for (let k = 0; k < 9; ++k) light += basis[k] * sum[3 * k + c];
        result[3 * p + c] = Math.max(0, light);
      }
    }
    return result;
  }
}

/** The floats of each probe, x fastest. */
function readProbes(renderer, grid) {
  const { x: nx, y: ny, z: nz } = grid.resolution;
  const layer = new Float32Array(4 * nx * ny);
  const probes = new Float32Array(floats * nx * ny * nz);
  const gl = renderer.getContext();
  const target = renderer.getRenderTarget();
  for (let part = 0; part < subVolumes; ++part) {
    for (let z = 0; z < nz; ++z) {
      renderer.setRenderTarget(grid._renderTarget, part * (nz + 2) + 1 + z);
      gl.readPixels(0, 0, nx, ny, gl.RGBA, gl.FLOAT, layer);
      for (let k = 0; k < nx * ny; ++k) {
        probes.set(layer.subarray(4 * k, 4 * k + 4), floats * (k + nx * ny * z) + 4 * part);
      }
    }
  }
  renderer.setRenderTarget(target);
  return probes;
}
