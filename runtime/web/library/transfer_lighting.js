// Rebounce for three.js: the light that lamps bounce, on a scene that stands still.

import * as THREE from 'three';
import { ProbeGrid } from './probe_grid.js';
import { Transfer } from './rebounce.js';
import { closeCracks } from './watertight.js';

const none = 0xFFFFFFFF;
const attributeName = 'bouncedIrradiance';

/** The three.js light as a light of Rebounce; null for one that is neither lamp nor sun. */
export function toLight(light) {
  const position = light.getWorldPosition(new THREE.Vector3()).toArray();
  const intensity = light.visible ? light.intensity : 0;
  const plain = { position, color: light.color.toArray(), intensity };
  const alongTarget = () => light.target.getWorldPosition(new THREE.Vector3())
                                .sub(light.getWorldPosition(new THREE.Vector3())).toArray();
  if (light.isPointLight) return { ...plain, type: 'point', range: light.distance };
  if (light.isSpotLight) {
    const outerConeAngle = light.angle;
    const spot = { outerConeAngle, innerConeAngle: outerConeAngle * (1 - light.penumbra) };
    return { ...plain, type: 'spot', range: light.distance, direction: alongTarget(), spot };
  }
  if (light.isDirectionalLight) return { ...plain, type: 'directional', direction: alongTarget() };
  if (light.isRectAreaLight) {
    const turned = light.getWorldQuaternion(new THREE.Quaternion());
    return {
      ...plain, type: 'rectangle', width: light.width, height: light.height,
      direction: new THREE.Vector3(0, 0, -1).applyQuaternion(turned).toArray(),
      tangent: new THREE.Vector3(1, 0, 0).applyQuaternion(turned).toArray(),
    };
  }
  return null;
}

// What three.js draws without shadows arrives by the attribute instead.
const lightLoops = THREE.ShaderChunk.lights_fragment_begin.replace(
    /NUM_(HEMI_LIGHTS|RECT_AREA_LIGHTS|LIGHT_PROBE_GRIDS)/g, '0');

function castsSoftly(light) {
  return light.type === 'rectangle' || light.type === 'disc' || light.type === 'sphere';
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
  #sky;
  #skyKey = '';
  #direct;

  /** Loads a transfer file; `onProgress` is told how much of it has come, in [0, 1]. */
  static async load(url, options) {
    const transfer = await Transfer.load(url, options);
    const textures = await Promise.all(transfer.materials.map(loadTexture));
    return new TransferLighting(transfer, textures);
  }

  constructor(transfer, textures) {
    this.#transfer = transfer;
    this.#engine = transfer.createEngine();
    this.#surface = seenSurface(transfer.mesh);
    this.#direct = new Float32Array(transfer.mesh.position.length);
    this.probes = transfer.probes ? new ProbeGrid(transfer.probes) : null;
    this.mesh = this.#makeMesh(textures);
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

  /** Lets a material of any mesh with the attribute show bounced light. */
  patch(material) {
    material.onBeforeCompile = (shader) => {
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
    return material;
  }

  /**
   * One frame: what arrives from `lights`, which are those of three.js or of a light file, and from
   * `sky`, { color, luminance, type, sunDirection } where the last two ask for a sky of the CIE.
   */
  update(lights, sky = {}) {
    const plain = [];
    for (const light of lights) {
      if (!light.isLight) plain.push(light);
      else if (light.isHemisphereLight) sky = fromHemisphere(light);
      else plain.push(toLight(light));
    }
    const known = plain.filter((light) => light !== null);
    if (sky !== this.#sky) this.#changeSky(sky);
    this.#engine.relight(known, sky);
    const begin = performance.now();
    this.#writeDirect(known, sky);
    this.#write(this.#attribute.array, this.#engine.vertexIrradiance());
    this.#attribute.needsUpdate = true;
    this.probes?.write(this.#engine.probeLight());
    this.#engine.timings.vertices = performance.now() - begin;
  }

  #changeSky(sky) {
    this.#sky = sky;
    const key = `${sky.type},${sky.sunDirection}`;
    if (!sky.type || key === this.#skyKey) return;
    this.#skyKey = key;
    this.#engine.setSky(sky.type, sky.sunDirection);
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
    fillAdded(shown, 3, this.#surface.added, count / 3);
  }

  #makeMesh(textures) {
    const { mesh, materials } = this.#transfer;
    const { added, triangle, from } = this.#surface;
    const spread = (values, size) => {
      const all = new Float32Array(values.length + size * added.length);
      all.set(values);
      return fillAdded(all, size, added, values.length / size);
    };
    const geometry = new THREE.BufferGeometry();
    const position = spread(mesh.position, 3), count = mesh.position.length / 3;
    added.forEach(({ at }, k) => {
      position.set(mesh.position.subarray(3 * at, 3 * at + 3), 3 * (count + k));
    });
    geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(spread(mesh.normal, 3), 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(spread(mesh.texcoord, 2), 2));
    geometry.setAttribute('color', new THREE.BufferAttribute(spread(mesh.color, 3), 3));
    this.#attribute = this.#addAttribute(geometry);
    const { index, groups } = groupByMaterial(triangle, from, mesh.triangleMaterial, materials.length);
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    for (const { start, count: size, material } of groups) geometry.addGroup(start, size, material);
    const drawn = new THREE.Mesh(geometry, materials.map((material, k) =>
        this.patch(makeMaterial(material, textures[k]))));
    drawn.castShadow = drawn.receiveShadow = true;
    return drawn;
  }

  #addAttribute(geometry) {
    const attribute = new THREE.BufferAttribute(
        new Float32Array(geometry.attributes.position.array.length), 3);
    attribute.setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute(attributeName, attribute);
    return attribute;
  }

  /**
   * The same surface once more, for other bounced light.
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

  /** Frees memory of the module and of the graphics card. */
  dispose() {
    for (const mesh of [this.mesh, ...this.#twins]) mesh.geometry.dispose();
    for (const material of this.mesh.material) {
      material.map?.dispose();
      material.dispose();
    }
    this.probes?.dispose();
    this.#engine.dispose();
    this.#transfer.dispose();
  }
}

/** Fills the values of added vertices, from number `count` on, by those of the ends of their edges. */
function fillAdded(values, size, added, count) {
  for (let k = 0; k < added.length; ++k) {
    const { ends: [a, b], part } = added[k];
    for (let c = 0; c < size; ++c) {
      values[size * (count + k) + c] =
          (1 - part) * values[size * a + c] + part * values[size * b + c];
    }
  }
  return values;
}

function fromHemisphere(light) {
  return { color: light.color.toArray(), luminance: light.intensity / Math.PI };
}

/**
 * The surface without cracks, and without sides that nothing sees: where two solids meet, these
 * would show as dots along the seam.
 */
function seenSurface({ position, triangle, trianglePatch, absorbed }) {
  const surface = closeCracks(position, triangle);
  const seen = (t) => trianglePatch[t] !== none && absorbed[trianglePatch[t]] < 0.98;
  const kept = surface.from.flatMap((t, k) => (seen(t) ? [k] : []));
  return {
    added: surface.added, from: kept.map((k) => surface.from[k]),
    triangle: kept.flatMap((k) => surface.triangle.slice(3 * k, 3 * k + 3)),
  };
}

/** The triangles of each material one after the other. */
function groupByMaterial(triangle, from, triangleMaterial, materialCount) {
  const index = new Uint32Array(triangle.length);
  const groups = [];
  let end = 0;
  for (let material = 0; material < materialCount; ++material) {
    const start = end;
    from.forEach((original, t) => {
      if (triangleMaterial[original] !== material) return;
      for (let k = 0; k < 3; ++k) index[end++] = triangle[3 * t + k];
    });
    if (end > start) groups.push({ start, count: end - start, material });
  }
  return { index, groups };
}

function makeMaterial(material, texture) {
  return new THREE.MeshLambertMaterial({
    name: material.name,
    color: new THREE.Color(...material.baseColor),
    emissive: new THREE.Color(...material.emittedLuminance),
    vertexColors: true,
    shadowSide: THREE.FrontSide,  // surfaces have a second side of their own where they show one
    map: texture,
    alphaTest: material.alphaMode === 'mask' ? material.alphaCutoff : 0,
    transparent: material.alphaMode === 'blend',
    opacity: material.alpha,
  });
}

const wraps = {
  repeat: THREE.RepeatWrapping, clamp: THREE.ClampToEdgeWrapping, mirror: THREE.MirroredRepeatWrapping,
};

async function loadTexture({ texture }) {
  if (!texture) return null;
  const made = new THREE.Texture(await createImageBitmap(new Blob([texture.image])));
  made.colorSpace = THREE.SRGBColorSpace;
  made.flipY = false;
  [made.wrapS, made.wrapT] = texture.wrap.map((wrap) => wraps[wrap]);
  made.needsUpdate = true;
  return made;
}
