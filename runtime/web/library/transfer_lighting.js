// Rebounce for three.js: the light that lamps bounce, on a scene that stands still.

import * as THREE from 'three';
import { Transfer } from './rebounce.js';

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

/**
 * Lights a scene of three.js from a transfer file: `mesh` is the scene's surface, which shows direct
 * light by three.js's own lamps and shadow maps, and bounced light by an attribute that `update`
 * writes each frame.
 */
export class TransferLighting {
  #transfer;
  #engine;
  #skyEngine;
  #attribute;
  #skyIrradiance;
  #skyKey = '';
  #parts = { value: new THREE.Vector2(1, 1) };  // of direct and bounced light that are shown

  /** Loads a transfer file; `onProgress` is told how much of it has come, in [0, 1]. */
  static async load(url, options) {
    const transfer = await Transfer.load(url, options);
    const textures = await Promise.all(transfer.materials.map(loadTexture));
    return new TransferLighting(transfer, textures);
  }

  constructor(transfer, textures) {
    this.#transfer = transfer;
    this.#engine = transfer.createEngine();
    // What the sky gives straight is lamps' work in three.js, which has none that is blocked.
    this.#skyEngine = transfer.createEngine({ pointsPerPatch: 1, lightCapacity: 0 });
    this.#skyIrradiance = new Float32Array(transfer.mesh.position.length);
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
    const key = JSON.stringify(sky);
    if (key !== this.#skyKey) {
      this.#skyKey = key;
      this.#changeSky(sky);
    }
    this.#engine.relight(plain.filter((light) => light !== null), sky);
    const [direct, bounced] = this.#parts.value;
    const arriving = this.#engine.vertexIrradiance();
    const shown = this.#attribute.array;
    for (let k = 0; k < shown.length; ++k) {
      shown[k] = bounced * arriving[k] + direct * this.#skyIrradiance[k];
    }
    this.#attribute.needsUpdate = true;
  }

  #changeSky(sky) {
    if (!this.#transfer.seesSky) return;
    for (const engine of [this.#engine, this.#skyEngine]) {
      if (sky.type) engine.setSky(sky.type, sky.sunDirection);
    }
    this.#skyEngine.relight([], sky);
    this.#skyIrradiance.set(this.#skyEngine.vertexDirectIrradiance());
  }

  #makeMesh(textures) {
    const { mesh, materials } = this.#transfer;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(mesh.position, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(mesh.normal, 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(mesh.texcoord, 2));
    geometry.setAttribute('color', new THREE.BufferAttribute(mesh.color, 3));
    this.#attribute = new THREE.BufferAttribute(new Float32Array(mesh.position.length), 3);
    this.#attribute.setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute(attributeName, this.#attribute);
    const { index, groups } = groupByMaterial(mesh, materials.length);
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    for (const { start, count, material } of groups) geometry.addGroup(start, count, material);
    const drawn = new THREE.Mesh(geometry, materials.map((material, k) =>
        this.patch(makeMaterial(material, textures[k]))));
    drawn.castShadow = drawn.receiveShadow = true;
    return drawn;
  }

  /** Frees memory of the module and of the graphics card. */
  dispose() {
    this.mesh.geometry.dispose();
    for (const material of this.mesh.material) {
      material.map?.dispose();
      material.dispose();
    }
    this.#engine.dispose();
    this.#skyEngine.dispose();
    this.#transfer.dispose();
  }
}

function fromHemisphere(light) {
  return { color: light.color.toArray(), luminance: light.intensity / Math.PI };
}

/** The triangles of each material one after the other. */
function groupByMaterial(mesh, materialCount) {
  const index = new Uint32Array(mesh.triangle.length);
  const groups = [];
  let start = 0;
  for (let material = 0; material < materialCount; ++material) {
    const first = start;
    mesh.triangleMaterial.forEach((of, t) => {
      if (of !== material) return;
      index.set(mesh.triangle.subarray(3 * t, 3 * t + 3), start);
      start += 3;
    });
    if (start > first) groups.push({ start: first, count: start - first, material });
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
