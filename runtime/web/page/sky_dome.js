// The sky as it is seen, behind the scene.

import * as THREE from 'three';

const width = 128, height = 64;

export class SkyDome {
  #texture;

  /** @param {number} radius m */
  constructor(radius) {
    this.#texture = new THREE.DataTexture(
        new Uint16Array(4 * width * height), width, height, THREE.RGBAFormat, THREE.HalfFloatType);
    this.#texture.minFilter = this.#texture.magFilter = THREE.LinearFilter;
    this.#texture.wrapS = THREE.RepeatWrapping;
    this.object = new THREE.Mesh(
        new THREE.SphereGeometry(radius, 48, 32),
        new THREE.MeshBasicMaterial({ map: this.#texture, side: THREE.BackSide, depthWrite: false }));
    this.object.renderOrder = -1;
  }

  /** Shows a sky as TransferLighting.update takes it, of the CIE. */
  paint(engine, { type, sunDirection, luminance, color }) {
    const { data } = this.#texture.image;
    engine.skyPanorama(type, sunDirection, width, height).forEach((part, k) => {
      [...color, 0].forEach((channel, c) => {
        data[4 * k + c] = THREE.DataUtils.toHalfFloat(c < 3 ? luminance * part * channel : 1);
      });
    });
    this.#texture.needsUpdate = true;
  }

  dispose() {
    this.#texture.dispose();
    this.object.geometry.dispose();
    this.object.material.dispose();
  }
}
