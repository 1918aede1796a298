// Lamps by mouse, finger and keys.

import * as THREE from 'three';

const reach = 26;  // pixels around a lamp in which it can be taken hold of

export class Hand {
  #stage;
  #held = null;
  #plane = new THREE.Plane();
  #ray = new THREE.Raycaster();
  #offset = new THREE.Vector3();

  /** Calls onChoose when another lamp is chosen. */
  constructor(stage, onChoose) {
    this.#stage = stage;
    const { canvas } = stage;
    // Before the camera's controls hear of it.
    canvas.addEventListener('pointerdown', (event) => {
      const lamp = this.#lampAt(event);
      if (!lamp) return;
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add('held');
      stage.chosen = lamp;
      stage.controls.enabled = false;
      this.#grab(lamp, event);
      onChoose();
    }, { capture: true });
    canvas.addEventListener('pointermove', (event) => {
      if (this.#held) this.#drag(event);
      else canvas.classList.toggle('over', this.#lampAt(event) !== null);
    });
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, () => {
        this.#held = null;
        stage.controls.enabled = true;
        canvas.classList.remove('held');
      });
    }
    canvas.addEventListener('keydown', (event) => this.#moveByKey(event));
  }

  #pointer(event) {
    const { left, top, width, height } = this.#stage.canvas.getBoundingClientRect();
    return new THREE.Vector2(
        2 * (event.clientX - left) / width - 1, 1 - 2 * (event.clientY - top) / height);
  }

  #lampAt(event) {
    const { clientWidth, clientHeight } = this.#stage.canvas;
    const pointer = this.#pointer(event);
    let nearest = null, least = reach;
    for (const lamp of this.#stage.lamps) {
      const at = lamp.object.position.clone().project(this.#stage.camera);
      const apart = Math.hypot((at.x - pointer.x) * clientWidth, (at.y - pointer.y) * clientHeight) / 2;
      if (at.z < 1 && apart < least) [nearest, least] = [lamp, apart];
    }
    return nearest;
  }

  #onPlane(event) {
    this.#ray.setFromCamera(this.#pointer(event), this.#stage.camera);
    return this.#ray.ray.intersectPlane(this.#plane, new THREE.Vector3());
  }

  // A lamp moves in the plane through it that faces the camera.
  #grab(lamp, event) {
    this.#held = lamp;
    const towards = this.#stage.camera.getWorldDirection(new THREE.Vector3());
    this.#plane.setFromNormalAndCoplanarPoint(towards, lamp.object.position);
    const at = this.#onPlane(event);
    this.#offset.copy(lamp.object.position).sub(at ?? lamp.object.position);
  }

  #drag(event) {
    const at = this.#onPlane(event);
    if (at) this.#stage.moveLamp(this.#held, at.add(this.#offset));
  }

  #moveByKey(event) {
    const { chosen, camera, size } = this.#stage;
    const axes = {
      ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
      PageUp: [0, 0, -1], PageDown: [0, 0, 1],
    };
    if (!chosen || !axes[event.key]) return;
    event.preventDefault();
    const step = new THREE.Vector3(...axes[event.key]).applyQuaternion(camera.quaternion);
    this.#stage.moveLamp(chosen, chosen.home.clone().addScaledVector(step, size / 40));
  }
}
