// Rebounce for three.js: the light that lamps bounce, on a scene that stands still.

import * as THREE from 'three';
import { SurfaceFitter } from './fitted_mesh.js';
import { loadTextures, makeMaterial } from './material.js';
import { ProbeGrid } from './probe_grid.js';
import { Transfer } from './rebounce.js';
import { Surface } from './surface.js';
import { replaceLightFormulas, toLight, toSky } from './three_lights.js';

export { toLight };

const attributeName = 'bouncedIrradiance';

// What three.js draws without shadows arrives by the attribute instead.
const lightLoops = THREE.ShaderChunk.lights_fragment_begin.replace(
    /NUM_(HEMI_LIGHTS|RECT_AREA_LIGHTS|LIGHT_PROBE_GRIDS)/g, '0');

function castsSoftly(light) {
  return light.type === 'rectangle' || light.type === 'disc' || light.type === 'sphere';
}

// Glass of three.js that casts no shadow; what emits counts as if nothing passed.
function isClear({ transmission, emissive }) {
  return transmission > 0.5 && emissive.getHex() === 0;
}

/**
 * Lights a scene of three.js from a transfer file: `mesh` is the scene's surface, `probes` a light
 * for what moves in it. The mesh shows direct light of points, spots and suns by three.js and its
 * shadow maps. All else, bounced light and the direct light of areas and of the sky, is an
 * attribute that `update` writes each frame.
 */
export class TransferLighting {
  #transfer;
  #engine;
  #surface;
  #attribute;
  #parts = { value: new THREE.Vector2(1, 1) };  // of direct and bounced light that are shown
  #twins = [];
  #attached = [];  // { attribute, vertices } of meshes of the scene's own
  #copies = [];    // of their materials
  #skyKey = '';
  #direct;

  /** Loads a transfer file; `onProgress` is told how much of it has come, in [0, 1]. */
  static async load(url, options) {
    const transfer = await Transfer.load(url, options);
    try {
      const textures = await Promise.all(transfer.materials.map(loadTextures));
      return new TransferLighting(transfer, textures);
    } catch (error) {
      transfer.dispose();
      throw error;
    }
  }

  constructor(transfer, textures) {
    this.#transfer = transfer;
    this.#surface = new Surface(transfer.mesh);
    this.#direct = new Float32Array(transfer.mesh.position.length);
    this.probes = transfer.probes ? new ProbeGrid(transfer.probes) : null;
    this.mesh = this.#makeMesh(textures);
    this.#engine = transfer.createEngine();  // last, so that no failure leaves it behind
  }

  get transfer() {
    return this.#transfer;
  }
  get engine() {
    return this.#engine;
  }
  get timings() {
    return this.#engine.timings;
  }

  /** How much of direct and of bounced light the mesh shows; 1 and 1 at first. */
  show(direct, bounced) {
    this.#parts.value.set(direct, bounced);
  }

  /** Lets a material show bounced light on any mesh with the attribute, and direct light to match. */
  patch(material) {
    material.onBeforeCompile = (shader) => {
      replaceLightFormulas(shader);
      shader.uniforms.rebounceParts = this.#parts;
      shader.vertexShader = shader.vertexShader
          .replace('#include <common>',
                   `#include <common>
attribute vec3 ${attributeName};
varying vec3 vBounced;`)
          .replace('#include <begin_vertex>',
                   `#include <begin_vertex>
vBounced = ${attributeName};`);
      shader.fragmentShader = shader.fragmentShader
          .replace('#include <common>',
                   `#include <common>
uniform vec2 rebounceParts;
varying vec3 vBounced;`)
          .replace('#include <lights_fragment_begin>', lightLoops)
          .replace('#include <lights_fragment_maps>',
                   `#include <lights_fragment_maps>
irradiance += vBounced;`)
          .replace('#include <lights_fragment_end>',
                   `#include <lights_fragment_end>
reflectedLight.directDiffuse *= rebounceParts.x;
reflectedLight.directSpecular *= rebounceParts.x;`);
    };
    material.customProgramCacheKey = () => 'rebounce';
    material.needsUpdate = true;  // it may have been drawn before
    return material;
  }

  /**
   * One frame: what arrives from `lights`, which are those of three.js or of a light file, and from
   * `sky`, { color, luminance, ground, type, sunDirection }: below the horizon it is `ground` times
   * as bright; the last two ask for a sky of the CIE instead.
   */
  update(lights, sky = {}) {
    const plain = [];
    for (const light of lights) {
      if (!light.isLight) plain.push(light);
      else if (light.isHemisphereLight) sky = toSky(light);
      else plain.push(toLight(light));
    }
    const known = plain.filter((light) => light !== null);
    this.#changeSky(sky);
    this.#engine.relight(known, sky);
    const begin = performance.now();
    this.#writeDirect(known, sky);
    this.#write(this.#attribute.array, this.#engine.vertexIrradiance());
    this.#attribute.needsUpdate = true;
    this.#writeAttached();
    this.probes?.write(this.#engine.probeLight(), this.#parts.value.y);
    this.#engine.timings.vertices = performance.now() - begin;
  }

  #changeSky({ type, sunDirection, ground }) {
    const key = `${type},${type ? sunDirection : ground}`;
    if (key === this.#skyKey) return;
    if (type) this.#engine.setSky(type, sunDirection);
    else if (ground !== undefined && this.#transfer.hasSkyCells) this.#engine.setSkyAboveGround(ground);
    else this.#engine.setUniformSky();
    this.#skyKey = key;  // of a sky that was not refused
  }

  #writeDirect(lights, sky) {
    const chosen = lights.map((light) => (castsSoftly(light) ? 1 : 0));
    const some = chosen.includes(1) || sky.luminance > 0;
    if (some) this.#direct.set(this.#engine.vertexDirectIrradianceOf(chosen));
    else this.#direct.fill(0);
  }

  #write(shown, bouncedIrradiance) {
    const [direct, bounced] = this.#parts.value;
    const count = bouncedIrradiance.length;
    for (let k = 0; k < count; ++k) {
      shown[k] = bounced * bouncedIrradiance[k] + direct * this.#direct[k];
    }
    this.#surface.fill(shown, 3);
  }

  #makeMesh(textures) {
    const { materials } = this.#transfer;
    const geometry = this.#surface.makeGeometry(materials.length);
    this.#attribute = this.#addAttribute(geometry);
    const drawn = new THREE.Mesh(geometry, materials.map((material, k) =>
        this.patch(makeMaterial(material, textures[k]))));
    drawn.castShadow = drawn.receiveShadow = true;
    return drawn;
  }

  /**
   * Lets the meshes in and below `object`, of the scene that the file was made from, show bounced
   * light: cuts them as the file's surface is cut, and patches copies of their materials. `mesh` is
   * not needed then. Throws RebounceError if a mesh is not part of the surface; nothing has changed
   * then.
   */
  attach(object) {
    object.updateWorldMatrix(true, true);
    const fitter = new SurfaceFitter(this.#surface);
    const fitted = [];
    object.traverse((mesh) => {
      if (mesh.isMesh) fitted.push({ mesh, ...fitter.fit(mesh, this.#transfer.name) });
    });
    const copies = new Map();
    const patched = (material) => {
      if (!copies.has(material)) {
        const copy = this.patch(material.clone());
        copy.side = THREE.FrontSide;  // the second sides of double-sided triangles have their own
        copy.shadowSide ??= THREE.FrontSide;
        copies.set(material, copy);
      }
      return copies.get(material);
    };
    for (const { mesh, geometry, vertices } of fitted) {
      mesh.geometry = geometry;
      mesh.material = Array.isArray(mesh.material)
          ? mesh.material.map(patched) : patched(mesh.material);
      mesh.castShadow = ![mesh.material].flat().every(isClear);
      mesh.receiveShadow = true;
      this.#attached.push({ mesh, vertices, attribute: this.#addAttribute(geometry) });
    }
    this.#copies.push(...copies.values());
  }

  #writeAttached() {
    const { array } = this.#attribute;
    for (const { vertices, attribute } of this.#attached) {
      for (let k = 0; k < vertices.length; ++k) {
        for (let c = 0; c < 3; ++c) attribute.array[3 * k + c] = array[3 * vertices[k] + c];
      }
      attribute.needsUpdate = true;
    }
  }

  #addAttribute(geometry) {
    const attribute = new THREE.BufferAttribute(
        new Float32Array(geometry.attributes.position.array.length), 3);
    attribute.setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute(attributeName, attribute);
    return attribute;
  }

  /**
   * The same surface once more, for other bounced light; it stays until `dispose`.
   * @returns {{mesh: THREE.Mesh, write: (irradiance: Float32Array) => void}} what to draw, and how
   *   to give it the light at the vertices of the file
   */
  makeTwin() {
    const geometry = new THREE.BufferGeometry();
    for (const [name, values] of Object.entries(this.mesh.geometry.attributes)) {
      geometry.setAttribute(name, values);
    }
    geometry.setIndex(this.mesh.geometry.index);
    for (const group of this.mesh.geometry.groups) geometry.groups.push(group);
    const attribute = this.#addAttribute(geometry);
    const mesh = new THREE.Mesh(geometry, this.mesh.material);
    mesh.receiveShadow = true;
    const write = (irradiance) => {
      this.#write(attribute.array, irradiance);
      attribute.needsUpdate = true;
    };
    this.#twins.push(mesh);
    return { mesh, write };
  }

  /** Frees memory of the module and of the graphics card; `update` throws RebounceError then. */
  dispose() {
    for (const mesh of [this.mesh, ...this.#twins]) mesh.geometry.dispose();
    for (const { mesh } of this.#attached) mesh.geometry.dispose();
    for (const copy of this.#copies) copy.dispose();
    for (const material of this.mesh.material) {
      material.map?.dispose();
      material.emissiveMap?.dispose();
      material.dispose();
    }
    this.probes?.dispose();
    this.#engine.dispose();
    this.#transfer.dispose();
  }
}
