// The surface of a transfer file as it is drawn: without cracks, by materials.

import * as THREE from 'three';
import { closeCracks } from './watertight.js';

const none = 0xFFFFFFFF;

export class Surface {
  #added;  // vertices that follow those of the file
  #from;   // the triangle of the file that each is part of
  #mesh;

  constructor(mesh) {
    const { triangle, from, added } = closeCracks(mesh.position, mesh.triangle);
    this.#mesh = mesh;
    this.#added = added;
    this.#from = from;
    this.triangle = triangle;
    // Sides that nothing sees would show as dots along the seam where two solids meet.
    this.isSeen = from.map((t) => {
      const patch = mesh.trianglePatch[t];
      return patch !== none && mesh.absorbed[patch] < 0.98;
    });
    this.position = this.spread(mesh.position, 3);
    const count = mesh.position.length / 3;
    added.forEach(({ at }, k) => {
      this.position.set(mesh.position.subarray(3 * at, 3 * at + 3), 3 * (count + k));
    });
  }

  /** Values of the file's vertices, [v][size], at those of the surface. */
  spread(values, size) {
    const all = new Float32Array(values.length + size * this.#added.length);
    all.set(values);
    return this.fill(all, size);
  }

  /** Fills the values of vertices that are not the file's by those of the ends of their edges. */
  fill(values, size) {
    const count = this.#mesh.position.length / 3;
    this.#added.forEach(({ ends: [a, b], part }, k) => {
      for (let c = 0; c < size; ++c) {
        values[size * (count + k) + c] =
            (1 - part) * values[size * a + c] + part * values[size * b + c];
      }
    });
    return values;
  }

  /** What is drawn, with a group for each material. */
  makeGeometry(materialCount) {
    const { normal, texcoord, emissiveTexcoord, color } = this.#mesh;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.position, 3));
    for (const [name, values, size] of [
      ['normal', normal, 3], ['uv', texcoord, 2], ['uv1', emissiveTexcoord, 2], ['color', color, 3],
    ]) {
      geometry.setAttribute(name, new THREE.BufferAttribute(this.spread(values, size), size));
    }
    const index = [];
    for (let material = 0; material < materialCount; ++material) {
      const start = index.length;
      this.#from.forEach((original, t) => {
        if (!this.isSeen[t] || this.#mesh.triangleMaterial[original] !== material) return;
        for (let k = 0; k < 3; ++k) index.push(this.triangle[3 * t + k]);
      });
      if (index.length > start) geometry.addGroup(start, index.length - start, material);
    }
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(index), 1));
    return geometry;
  }
}
