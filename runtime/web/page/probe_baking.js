// three.js's own answer in the other half of the picture: a LightProbeGridWebGL, baked a few probes a
// frame.

import * as THREE from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { Side } from './comparison.js';
import { replaceLightFormulas, toLight } from '../library/three_lights.js';
import { GridLight } from './grid_light.js';

const furtherBounces = 1;  // as in three.js's example of a large scene
const measuredEvery = 8;   // frames: reading back waits for the graphics card

/** The surface with three.js's own materials; all of them take up a grid of probes. */
function makePlain(mesh) {
  const materials = mesh.material.map((lit) => {
    // Lambert's, which area lights do not reach, in the shape of the one that they do.
    const plain = new THREE.MeshPhysicalMaterial({ roughness: 1, specularIntensity: 0 });
    plain.onBeforeCompile = replaceLightFormulas;  // the lamps are those of the other half
    for (const name of ['color', 'emissive', 'vertexColors', 'shadowSide', 'visible', 'map',
                        'emissiveMap', 'alphaTest', 'transparent', 'opacity']) {
      plain[name] = lit[name];
    }
    return plain;
  });
  const plain = new THREE.Mesh(mesh.geometry, materials);
  plain.castShadow = plain.receiveShadow = true;
  return plain;
}

function makeGrid(bounds, probeCount) {
  const size = bounds.getSize(new THREE.Vector3());
  const cell = Math.cbrt(size.x * size.y * size.z / probeCount);
  const counts = size.toArray().map((length) => Math.max(2, Math.round(length / cell)));
  const grid = new LightProbeGridWebGL(...size.toArray(), ...counts);
  bounds.getCenter(grid.position);
  grid.updateBoundingBox();
  return grid;
}

function rowsOf(values) {
  return Array.from({ length: values.length / 3 }, (_, k) => [...values.subarray(3 * k, 3 * k + 3)]);
}

export class ProbeBaking {
  kind = 'probes';
  title = 'LightProbeGrid';
  pace = 4;       // probes a frame
  mostPace = 32;
  ours = new Side();
  theirs = new Side();
  #stage;
  #plain;
  #grid;
  #light;
  #lit = '';         // the lights that the running bake began with
  #next = 0;         // probe of the running pass
  #pass = 0;
  #isBaked = false;
  #frame = 0;
  #measured = '';    // the lights of the last measurement of a bake that was done

  /** About `probeCount` probes; by default as in three.js's example of a large scene. */
  constructor(stage, solver, { probeCount = 490 } = {}) {
    this.#stage = stage;
    this.solver = solver;
    this.#plain = makePlain(stage.lighting.mesh);
    this.#grid = makeGrid(stage.bounds, probeCount);
    this.objects = [this.#plain, this.#grid];
    const { centroid, normal } = stage.lighting.transfer.patches;
    this.#light = new GridLight(this.#grid, rowsOf(centroid), rowsOf(normal));
  }

  get #count() {
    const { x, y, z } = this.#grid.resolution;
    return x * y * z;
  }

  get paceText() {
    return `${this.pace} ${this.pace === 1 ? 'probe' : 'probes'} a frame`;
  }

  get note() {
    const { x, y, z } = this.#grid.resolution;
    return `${x} × ${y} × ${z} probes`;
  }

  /** One frame, after that of the lighting: bakes the next probes if light has changed. */
  update() {
    const { lighting, lights, sky } = this.#stage;
    this.ours.add(this.solver.converge(lighting.engine));
    const key = JSON.stringify([lights.map(toLight), sky]);
    if (this.#isBaked && key !== this.#lit) this.#isBaked = false;
    if (!this.#isBaked) this.#bakeSome(key);
    this.theirs.lag.add(this.#isBaked && key === this.#lit);
    // A bake that is done is measured once, when it is.
    if (this.#frame++ % measuredEvery === 0 || this.theirs.lag.frames === 0) this.#measure(key);
  }

  #bakeSome(key) {
    if (this.#next === 0 && this.#pass === 0) this.#lit = key;
    const count = Math.min(this.pace, this.#count - this.#next);
    const restore = this.#showAlone();
    this.#grid.bake(this.#stage.renderer, this.#stage.scene, {
      start: this.#next, count, pass: this.#pass, near: this.#stage.camera.near,
      far: this.#stage.camera.far,
    });
    restore();
    this.#next += count;
    if (this.#next < this.#count) return;
    this.#next = 0;
    this.#pass = this.#pass < furtherBounces ? this.#pass + 1 : 0;
    this.#isBaked = this.#pass === 0;
  }

  /** Takes away what probes should not see; the result brings it back. */
  #showAlone() {
    const { lamps, ball, lighting } = this.#stage;
    const hidden = [
      lighting.mesh, lighting.probes, ball?.object, ...lamps.flatMap(({ bulb, ring }) => [bulb, ring]),
    ].filter((object) => object?.visible);
    for (const object of hidden) object.visible = false;
    for (const object of this.objects) object.visible = true;
    return () => {
      for (const object of hidden) object.visible = true;
      for (const object of this.objects) object.visible = false;
    };
  }

  #measure(key) {
    if (this.#measured === key && this.#isBaked) return;
    this.#measured = this.#isBaked ? key : '';
    const { renderer, lighting, sky } = this.#stage;
    const light = this.#light.read(renderer, this.#grid);
    if (sky.luminance > 0) {
      // Probes see the sky too, which is direct light.
      lighting.engine.vertexDirectIrradianceOf(this.#stage.lights.map(() => 0));
      lighting.engine.chosenDirectIrradiance().forEach((direct, k) => { light[k] -= direct; });
    }
    this.theirs.error = this.solver.errorOf(light);
  }

  /** To be called around the drawing of its half; the result draws what follows as before. */
  begin() {
    const { lighting, lights, part } = this.#stage;
    const probes = lighting.probes;
    if (probes) probes.visible = false;
    if (part === 'direct') this.#grid.visible = false;
    const intensities = lights.map((light) => light.intensity);
    if (part === 'bounced') for (const light of lights) light.intensity = 0;
    return () => {
      if (probes) probes.visible = true;
      lights.forEach((light, k) => { light.intensity = intensities[k]; });
    };
  }

  dispose() {
    this.solver.dispose();
    this.#grid.dispose();
    for (const material of this.#plain.material) material.dispose();
  }
}
