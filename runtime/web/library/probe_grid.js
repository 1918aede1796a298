// Probes as three.js reads them: a light in the shape of its LightProbeGrid, for what moves.

import * as THREE from 'three';

const floats = 27;      // of a probe: harmonics of degree 0 to 2, three channels
const subVolumes = 7;   // of four floats each, one above the other in the texture

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
  #standIns;
  #light;

  /** @param {{grid: number[], valid: Uint8Array, first: number[], last: number[]}} probes */
  constructor({ grid, valid, first, last }) {
    super(0xffffff, 1);
    const [nx, ny, nz] = grid;
    // A cell around each probe.
    const half = grid.map((count, c) => (count > 1 ? (last[c] - first[c]) / (count - 1) / 2 : 1));
    this.boundingBox = new THREE.Box3(
        new THREE.Vector3(...first.map((x, c) => x - half[c])),
        new THREE.Vector3(...last.map((x, c) => x + half[c])));
    this.resolution = new THREE.Vector3(nx, ny, nz);
    const depth = subVolumes * (nz + 2);
    this.texture = new THREE.Data3DTexture(new Uint16Array(4 * nx * ny * depth), nx, ny, depth);
    this.texture.format = THREE.RGBAFormat;
    this.texture.type = THREE.HalfFloatType;
    this.texture.minFilter = this.texture.magFilter = THREE.LinearFilter;
    this.#standIns = findStandIns(grid, valid);
    this.#light = new Float32Array(floats * nx * ny * nz);
  }

  /** @param {Float32Array} light [probes][9][3], cd/m² */
  write(light) {
    const own = this.#light;
    own.set(light);
    for (const { probe, around } of this.#standIns) {
      for (let k = 0; k < floats; ++k) {
        let sum = 0;
        for (const other of around) sum += own[floats * other + k];
        own[floats * probe + k] = sum / around.length;
      }
    }
    const { x: nx, y: ny, z: nz } = this.resolution;
    const layer = nx * ny;
    const { data } = this.texture.image;
    for (let part = 0; part < subVolumes; ++part) {
      for (let slice = 0; slice < nz + 2; ++slice) {  // the first and the last are there twice
        const from = layer * Math.min(Math.max(slice - 1, 0), nz - 1);
        const to = layer * (part * (nz + 2) + slice);
        for (let k = 0; k < layer; ++k) {
          for (let c = 0; c < 4; ++c) {
            const number = 4 * part + c;
            data[4 * (to + k) + c] = number < floats
                ? THREE.DataUtils.toHalfFloat(own[floats * (from + k) + number]) : 0;
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
