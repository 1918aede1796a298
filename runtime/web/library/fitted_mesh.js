// A mesh of three.js that a transfer file was made from, cut as the file's surface is: each vertex
// of the result is one of the surface, so that it has light.

import * as THREE from 'three';
import { RebounceError } from './instance.js';

const slack = 2e-5;         // of the surface's size: triangles this far from a plane lie in it
const leastFound = 0.99;    // of the area of a triangle that fits
const sliver = 1e-7;        // of the surface's size squared: less area is no matter
const cellsAcross = 32;

/** The triangles of a surface by cells of a grid. */
class SurfaceGrid {
  #cells = new Map();
  #centroids;
  #normals;  // as long as twice the area

  constructor({ position, triangle }) {
    this.triangle = triangle;
    this.box = new THREE.Box3().setFromArray(position);
    this.size = this.box.getSize(new THREE.Vector3()).length();
    const corner = (t, k) => new THREE.Vector3().fromArray(position, 3 * triangle[3 * t + k]);
    const count = triangle.length / 3;
    this.#centroids = [];
    this.#normals = [];
    for (let t = 0; t < count; ++t) {
      const [a, b, c] = [corner(t, 0), corner(t, 1), corner(t, 2)];
      this.#normals.push(new THREE.Vector3().crossVectors(b.clone().sub(a), c.clone().sub(a)));
      const centroid = a.add(b).add(c).divideScalar(3);
      this.#centroids.push(centroid);
      const name = this.#cellOf(centroid).join();
      if (this.#cells.has(name)) this.#cells.get(name).push(t);
      else this.#cells.set(name, [t]);
    }
  }

  #cellOf(point) {
    return point.toArray().map((x) => Math.floor(x / this.size * cellsAcross));
  }

  /**
   * The surface's triangles that lie within another, those that face against it only if
   * `bothSides`; and how much of its area those that face its way have.
   * @param {THREE.Triangle} whole
   */
  within(whole, bothSides) {
    const off = slack * this.size;
    const normal = whole.getNormal(new THREE.Vector3());
    const area = whole.getArea();
    const box = new THREE.Box3().setFromPoints([whole.a, whole.b, whole.c]).expandByScalar(off)
                    .intersect(this.box);
    const low = this.#cellOf(box.min), high = this.#cellOf(box.max);
    const at = new THREE.Vector3(), found = [];
    let facing = 0;
    for (let i = low[0]; i <= high[0]; ++i) {
      for (let j = low[1]; j <= high[1]; ++j) {
        for (let k = low[2]; k <= high[2]; ++k) {
          for (const t of this.#cells.get(`${i},${j},${k}`) ?? []) {
            const along = this.#normals[t].dot(normal) / 2;
            if (along <= 0 && !bothSides) continue;
            at.copy(this.#centroids[t]).sub(whole.a);
            if (Math.abs(at.dot(normal)) > off) continue;
            if (!whole.containsPoint(this.#centroids[t])) continue;
            found.push(t);
            facing += Math.max(0, along);
          }
        }
      }
    }
    return { found, part: area > sliver * this.size ** 2 ? facing / area : 1 };
  }
}

/** Finds where the triangles of meshes are on a surface, { position, triangle, isSeen }. */
export class SurfaceFitter {
  #surface;
  #grid;

  constructor(surface) {
    this.#surface = surface;
    this.#grid = new SurfaceGrid(surface);
  }

  /**
   * Cuts a mesh as the surface is.
   * @param {THREE.Mesh} mesh with its world matrix up to date
   * @param {string} file what messages call the surface's file
   * @returns {{geometry: THREE.BufferGeometry, vertices: Uint32Array}} with the attributes of the
   *   mesh, and the vertex of the surface that each of its vertices is
   */
  fit(mesh, file) {
    refuseWhatMoves(mesh);
    const { geometry, matrixWorld } = mesh;
    const { index } = geometry;
    const place = geometry.attributes.position;
    const mirrored = matrixWorld.determinant() < 0;
    const groups = geometry.groups.length > 0
        ? geometry.groups : [{ start: 0, count: (index ?? place).count, materialIndex: 0 }];
    const made = new Pieces(geometry, this.#surface, matrixWorld);
    for (const { start, count, materialIndex } of groups) {
      const material = Array.isArray(mesh.material) ? mesh.material[materialIndex] : mesh.material;
      const bothSides = material?.side === THREE.DoubleSide;
      made.beginGroup(materialIndex);
      const end = Math.min(start + count, (index ?? place).count);
      for (let k = start; k + 3 <= end; k += 3) {
        const corners = [0, 1, 2].map((c) => (index ? index.getX(k + c) : k + c));
        const [a, b, c] = corners.map(
            (v) => new THREE.Vector3().fromBufferAttribute(place, v).applyMatrix4(matrixWorld));
        const whole = mirrored ? new THREE.Triangle(a, c, b) : new THREE.Triangle(a, b, c);
        const { found, part } = this.#grid.within(whole, bothSides);
        if (part < leastFound) refuse(mesh, file, k / 3, whole);
        made.add(corners, [a, b, c], whole, found, mirrored);
      }
    }
    return made.finish();
  }
}

function refuse(mesh, file, triangle, whole) {
  const near = whole.getMidpoint(new THREE.Vector3()).toArray().map((x) => x.toFixed(3)).join(', ');
  throw new RebounceError(
      `${titleOf(mesh)} does not fit ${file}: its triangle ${triangle}, near (${near}), is not ` +
      'part of that surface; precompute the scene again, or leave the mesh out');
}

function refuseWhatMoves(mesh) {
  const moves = mesh.isSkinnedMesh || mesh.morphTargetInfluences?.length > 0;
  if (!moves && !mesh.isInstancedMesh) return;
  throw new RebounceError(
      `${titleOf(mesh)} ${moves ? 'changes its shape' : 'is instanced'}; leave it out, and light ` +
      'it by probes');
}

const titleOf = (mesh) => (mesh.name ? `the mesh "${mesh.name}"` : 'a mesh without a name');

/** Gathers the pieces of a mesh. */
class Pieces {
  #surface;
  #vertices = [];
  #index = [];
  #groups = [];
  #values = new Map();  // of each attribute but the position
  #positions = [];

  constructor(geometry, surface, matrixWorld) {
    this.#surface = surface;
    this.from = geometry;
    this.toLocal = matrixWorld.clone().invert();
    for (const name of Object.keys(geometry.attributes)) {
      if (name !== 'position') this.#values.set(name, []);
    }
  }

  beginGroup(materialIndex) {
    this.#groups.push({ start: this.#index.length, materialIndex });
  }

  /** Adds the surface's triangles `found` that lie within the triangle of `corners` at `places`. */
  add(corners, places, whole, found, mirrored) {
    const { triangle, position, isSeen } = this.#surface;
    const normal = whole.getNormal(new THREE.Vector3());
    const known = new Map();
    for (const t of found) {
      if (!isSeen[t]) continue;
      const own = [...triangle.slice(3 * t, 3 * t + 3)];
      const [p, q, r] = own.map((v) => new THREE.Vector3().fromArray(position, 3 * v));
      const side = Math.sign(q.clone().sub(p).cross(r.clone().sub(p)).dot(normal));
      const made = own.map((v, k) => {
        const key = side * (v + 1);
        if (!known.has(key)) known.set(key, this.#addVertex(v, [p, q, r][k], corners, places, side));
        return known.get(key);
      });
      this.#index.push(...(mirrored ? [made[0], made[2], made[1]] : made));
    }
  }

  #addVertex(vertex, at, corners, places, side) {
    const parts = THREE.Triangle.getBarycoord(at, ...places, new THREE.Vector3()).toArray();
    for (const [name, values] of this.#values) {
      const attribute = this.from.attributes[name];
      const sign = name === 'normal' ? side : 1;
      for (let c = 0; c < attribute.itemSize; ++c) {
        values.push(sign * parts.reduce(
            (sum, part, k) => sum + part * attribute.getComponent(corners[k], c), 0));
      }
    }
    this.#positions.push(...at.clone().applyMatrix4(this.toLocal).toArray());
    return this.#vertices.push(vertex) - 1;
  }

  finish() {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(this.#positions, 3));
    for (const [name, values] of this.#values) {
      const { itemSize } = this.from.attributes[name];
      geometry.setAttribute(name, new THREE.Float32BufferAttribute(values, itemSize));
    }
    geometry.setIndex(this.#index);
    this.#groups.forEach(({ start, materialIndex }, k) => {
      const end = this.#groups[k + 1]?.start ?? this.#index.length;
      geometry.addGroup(start, end - start, materialIndex);
    });
    return { geometry, vertices: Uint32Array.from(this.#vertices) };
  }
}
