// A ball that moves through the light: lamps light it as they do all in three.js, and probes bounce.

import * as THREE from 'three';
import { replaceLightFormulas } from '../library/three_lights.js';
import { makeRing } from './ring.js';

export class Ball {
  #direct = { value: 1 };

  constructor({ position, radius }) {
    this.home = new THREE.Vector3(...position);
    const material = new THREE.MeshStandardMaterial({ color: '#e9e4da', roughness: 0.9 });
    material.onBeforeCompile = (shader) => {
      replaceLightFormulas(shader);
      shader.uniforms.directPart = this.#direct;
      shader.fragmentShader = shader.fragmentShader
          .replace('#include <common>', '#include <common>\nuniform float directPart;')
          .replace('#include <lights_fragment_end>',
                   `#include <lights_fragment_end>
reflectedLight.directDiffuse *= directPart;
reflectedLight.directSpecular *= directPart;`);
    };
    this.object = new THREE.Mesh(new THREE.SphereGeometry(radius, 48, 32), material);
    this.object.castShadow = this.object.receiveShadow = true;
    this.object.position.copy(this.home);
    this.ring = makeRing(1.2 * radius);
    this.object.add(this.ring);
  }

  /** To be called before a frame is drawn. */
  face(camera, chosen) {
    this.ring.visible = chosen;
    this.ring.quaternion.copy(camera.quaternion);
  }

  /** Shows direct light or not; bounced light is that of the probes. */
  showDirect(isShown) {
    this.#direct.value = isShown ? 1 : 0;
  }

  swing(seconds, size) {
    this.object.position.set(
        this.home.x + size * Math.sin(0.9 * seconds), this.home.y,
        this.home.z + 0.5 * size * Math.sin(1.8 * seconds));
  }

  dispose() {
    for (const mesh of [this.object, this.ring]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}
