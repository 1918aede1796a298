// A lamp that can be dragged: a light of three.js with a bulb to take hold of.

import * as THREE from 'three';

export class Lamp {
  constructor({ position, color, intensity }, radius, reach) {
    this.full = intensity;  // cd, at the middle of its slider
    this.part = 1;
    this.on = true;
    this.home = new THREE.Vector3(...position);
    this.light = new THREE.PointLight(color, intensity);
    this.light.castShadow = true;
    this.light.shadow.mapSize.set(1024, 1024);
    this.light.shadow.camera.near = radius;
    this.light.shadow.camera.far = reach;
    this.light.shadow.bias = -0.0015;
    this.light.shadow.normalBias = radius / 8;
    this.bulb = new THREE.Mesh(
        new THREE.SphereGeometry(radius, 24, 16), new THREE.MeshBasicMaterial({ toneMapped: false }));
    this.ring = new THREE.Mesh(
        new THREE.RingGeometry(radius * 1.6, radius * 1.85, 48),
        new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.8, toneMapped: false }));
    this.object = new THREE.Group();
    this.object.add(this.light, this.bulb, this.ring);
    this.object.position.copy(this.home);
    this.color = color;
  }

  get color() {
    return `#${this.light.color.getHexString()}`;
  }
  set color(color) {
    this.light.color.set(color);
    this.ring.material.color.set(color);
    this.refresh();
  }

  /** To be called when it is switched or dimmed. */
  refresh() {
    this.light.intensity = this.on ? this.full * this.part : 0;
    this.light.castShadow = this.on;
    this.bulb.material.color.copy(this.light.color);
    if (!this.on) this.bulb.material.color.multiplyScalar(0.15);
  }

  /** Swings around where it was left, on an arc of `size` metres. */
  swing(seconds, size) {
    this.object.position.set(
        this.home.x + size * Math.sin(1.7 * seconds),
        this.home.y + 0.15 * size * Math.cos(3.4 * seconds),
        this.home.z + 0.6 * size * Math.cos(1.3 * seconds));
  }

  dispose() {
    this.light.dispose();
    for (const mesh of [this.bulb, this.ring]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}
