// Probes as three.js reads them: a light in the shape of its LightProbeGrid, for what moves.

import * as THREE from 'three';

const floats = 27;  // of a probe: harmonics of degree 0 to 2, three channels
export const subVolumes = 7;  // of four floats each, one above the other in the texture

/** For each probe that is inside of something, others whose mean stands for it, nearest first. */
function findStandIns([nx, ny, nz], valid) {
  const known = Uint8Array.from(valid);
  const standIns = [];
  const name = (x, y, z) => x + nx * (y + ny * z);
  for (let found = true; found;) {
    const now = [];
    for (let z = 0; z < nz; ++z) {
      for (let y = 0; y < ny; ++y) {
        for (let x = 0; x < nx; ++x) {
          if (known[name(x, y, z)]) continue;
          const around = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]]
              .map(([i, j, k]) => [x + i, y + j, z + k])
              .filter(([i, j, k]) => i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz)
              .map(([i, j, k]) => name(i, j, k)).filter((probe) => known[probe]);
          if (around.length > 0) now.push({ probe: name(x, y, z), around });
        }
      }
    }
    for (const { probe } of now) known[probe] = 1;
    standIns.push(...now);
    found = now.length > 0;
  }
  return standIns;
}

/** A light that standard materials take up, where three.js knows `LightProbeGrid`. */
export class ProbeGrid extends THREE.Light {
  isLightProbeGrid = true;
  type = 'ProbeGrid';
  priority = 0;
  #grid;
  #standIns;
  #light;

  /** @param {{grid: number[], valid: Uint8Array, first: number[], last: number[]}} probes */
  constructor({ grid, valid, first, last }) {
    super(0xffffff, 1);
    // A cell around each probe, and cells beyond the outermost that repeat them: three.js looks half
    // a cell off a surface, and finds no light beyond the grid.
    const size = grid.map((count) => count + 2);
    const cell = grid.map((count, c) => (count > 1 ? (last[c] - first[c]) / (count - 1) : 2));
    this.boundingBox = new THREE.Box3(
        new THREE.Vector3(...first.map((x, c) => x - 1.5 * cell[c])),
        new THREE.Vector3(...last.map((x, c) => x + 1.5 * cell[c])));
    this.resolution = new THREE.Vector3(...size);
    this.#grid = grid;
    const depth = subVolumes * (size[2] + 2);
    this.texture = new THREE.Data3DTexture(
        new Uint16Array(4 * size[0] * size[1] * depth), size[0], size[1], depth);
    this.texture.format = THREE.RGBAFormat;
    this.texture.type = THREE.HalfFloatType;
    this.texture.minFilter = this.texture.magFilter = THREE.LinearFilter;
    this.#standIns = findStandIns(grid, valid);
    this.#light = new Float32Array(floats * valid.length);
  }

  /** @param {Float32Array} light [probes][9][3], cd/m², shown times `part` */
  write(light, part = 1) {
    const own = this.#light;
    for (let k = 0; k < own.length; ++k) own[k] = part * light[k];
    for (const { probe, around } of this.#standIns) {
      for (let k = 0; k < floats; ++k) {
        let sum = 0;
        for (const other of around) sum += own[floats * other + k];
        own[floats * probe + k] = sum / around.length;
      }
    }
    const [nx, ny, nz] = this.#grid;
    const within = (k, count) => Math.min(Math.max(k - 1, 0), count - 1);
    const { data, width, height } = this.texture.image;
    for (let volume = 0, to = 0; volume < subVolumes; ++volume) {
      for (let z = 0; z < nz + 4; ++z) {  // one more at both ends, as three.js wants it
        for (let y = 0; y < height; ++y) {
          for (let x = 0; x < width; ++x, to += 4) {
            const probe =
                within(x, nx) + nx * (within(y, ny) + ny * within(z - 1, nz));
            for (let c = 0; c < 4; ++c) {
              const number = 4 * volume + c;
              data[to + c] = number < floats
                  ? THREE.DataUtils.toHalfFloat(own[floats * probe + number]) : 0;
            }
          }
        }
      }
    }
    this.texture.needsUpdate = true;
  }

  dispose() {
    super.dispose();
    this.texture.dispose();
  }
}
