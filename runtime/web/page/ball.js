// A ball that moves through the light: lamps light it as they do all in three.js, and probes bounce.

import * as THREE from 'three';

export class Ball {
  constructor({ position, radius }) {
    this.home = new THREE.Vector3(...position);
    this.object = new THREE.Mesh(
        new THREE.SphereGeometry(radius, 48, 32),
        new THREE.MeshStandardMaterial({ color: '#e9e4da', roughness: 0.9 }));
    this.object.castShadow = this.object.receiveShadow = true;
    this.object.position.copy(this.home);
  }

  swing(seconds, size) {
    this.object.position.set(
        this.home.x + size * Math.sin(0.9 * seconds), this.home.y,
        this.home.z + 0.5 * size * Math.sin(1.8 * seconds));
  }

  dispose() {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }
}
