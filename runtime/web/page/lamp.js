// A lamp that can be dragged: a light of three.js with something to take hold of.

import * as THREE from 'three';
import { makeRing } from './ring.js';

/** The lamps that the page offers. */
export const lampKinds = [
  { kind: 'point', title: 'Point' }, { kind: 'spot', title: 'Spot' }, { kind: 'area', title: 'Area' },
];

const facingDown = new THREE.Euler(-Math.PI / 2, 0, 0);

/**
 * Lets a light cast shadows. The bias is a length, and three.js compares depths, which a
 * perspective camera spreads as near / distance².
 */
export function castShadows(light, near, far, size) {
  light.castShadow = true;
  light.shadow.mapSize.set(1024, 1024);
  light.shadow.camera.near = near;
  light.shadow.camera.far = far;
  light.shadow.bias = -0.002 * near / size;
  light.shadow.normalBias = size / 700;
}

export class Lamp {
  /** `place` has the sizes of the scene: `lampRadius`, `size` and `floor`, where spots aim. */
  constructor({ kind = 'point', position, color, intensity }, place) {
    this.kind = kind;
    this.part = 1;
    this.on = true;
    this.home = new THREE.Vector3(...position);
    this.object = new THREE.Group();
    this.object.position.copy(this.home);
    const { lampRadius: radius, size } = place;
    this.glow = new THREE.MeshBasicMaterial({ toneMapped: false, side: THREE.DoubleSide });
    if (kind === 'point') this.#makePoint(intensity, radius, size);
    else if (kind === 'spot') this.#makeSpot(intensity, radius, place);
    else this.#makeArea(intensity, size);
    this.ring = makeRing(1.6 * radius);
    this.object.add(this.light, this.bulb, this.ring);
    this.color = color;
  }

  #makePoint(intensity, radius, size) {
    this.full = intensity;  // cd, at the middle of its slider
    this.light = new THREE.PointLight();
    castShadows(this.light, radius, 2 * size, size);
    this.bulb = new THREE.Mesh(new THREE.SphereGeometry(radius, 24, 16), this.glow);
  }

  #makeSpot(intensity, radius, { size, floor }) {
    this.full = 3 * intensity;
    this.light = new THREE.SpotLight(0xffffff, 1, 0, 0.5, 0.4);
    this.light.position.set(0, 0, 0);  // three.js begins above
    this.target = this.light.target;
    this.target.position.copy(floor);
    castShadows(this.light, radius, 2 * size, size);
    this.bulb = new THREE.Mesh(new THREE.ConeGeometry(0.9 * radius, 2 * radius, 24), this.glow);
    this.bulb.geometry.rotateX(-Math.PI / 2);  // its tip away from the target
  }

  #makeArea(intensity, size) {
    const [width, height] = [0.2 * size, 0.12 * size];
    this.full = 2 * intensity / (width * height);  // cd/m²
    this.light = new THREE.RectAreaLight(0xffffff, 1, width, height);
    this.light.rotation.copy(facingDown);
    this.bulb = new THREE.Mesh(new THREE.PlaneGeometry(width, height), this.glow);
    this.bulb.rotation.copy(facingDown);
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
    if (this.light.shadow) this.light.castShadow = this.on;
    this.glow.color.copy(this.light.color);
    if (!this.on) this.glow.color.multiplyScalar(0.15);
  }

  /** Swings around where it was left, on an arc of `size` metres. */
  swing(seconds, size) {
    this.object.position.set(
        this.home.x + size * Math.sin(1.7 * seconds),
        this.home.y + 0.15 * size * Math.cos(3.4 * seconds),
        this.home.z + 0.6 * size * Math.cos(1.3 * seconds));
  }

  /** To be called before a frame is drawn. */
  face(camera, chosen) {
    this.ring.visible = chosen;
    this.ring.quaternion.copy(camera.quaternion);
    if (this.target) this.bulb.lookAt(this.target.position);
  }

  dispose() {
    this.light.dispose();
    for (const mesh of [this.bulb, this.ring]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}
