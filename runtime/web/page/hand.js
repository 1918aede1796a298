// Lamps, and the ball, by mouse, finger and keys.

import * as THREE from 'three';

const reach = 26;  // pixels around a lamp in which it can be taken hold of

export class Hand {
  #stage;
  #held = null;
  #pointerId = null;  // of the finger or mouse that holds it
  #plane = new THREE.Plane();
  #ray = new THREE.Raycaster();
  #offset = new THREE.Vector3();

  /** Calls onChoose when another lamp is chosen. */
  constructor(stage, onChoose) {
    this.#stage = stage;
    const { canvas } = stage;
    // Before the camera's controls hear of it.
    canvas.addEventListener('pointerdown', (event) => {
      if (this.#held || !event.isPrimary || event.button !== 0) return;
      const thing = this.#thingAt(event);
      if (!thing) return;
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add('held');
      stage.controls.enabled = false;
      this.#grab(thing, event);
      stage.chosen = thing;
      onChoose();
    }, { capture: true });
    canvas.addEventListener('pointermove', (event) => {
      if (!this.#held) canvas.classList.toggle('over', this.#thingAt(event) !== null);
      else if (event.pointerId === this.#pointerId) this.#drag(event);
    });
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, (event) => {
        if (event.pointerId !== this.#pointerId) return;
        this.#held = this.#pointerId = null;
        stage.controls.enabled = true;
        canvas.classList.remove('held');
      });
    }
    canvas.addEventListener('keydown', (event) => this.#moveByKey(event));
  }

  // Where the pointer is in the view that it is in, from -1 to 1, and that view.
  #pointer(event) {
    const { left, top } = this.#stage.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    const views = this.#stage.views();
    const view = views.find((one) => x < one.left + one.width && y < one.top + one.height) ??
        views.at(-1);
    const at = new THREE.Vector2(
        2 * (x - view.left) / view.width - 1, 1 - 2 * (y - view.top) / view.height);
    return { at, view };
  }

  #thingAt(event) {
    const { at: pointer, view } = this.#pointer(event);
    const { camera, ball, movable, description } = this.#stage;
    let nearest = null, least = Infinity;
    for (const thing of movable) {
      const place = thing.object.position;
      const at = place.clone().project(camera);
      const apart = Math.hypot((at.x - pointer.x) * view.width, (at.y - pointer.y) * view.height) / 2;
      const size = thing !== ball ? 0 : camera.view.fullHeight * description.ball.radius /
          (2 * place.distanceTo(camera.position) * Math.tan(camera.fov * Math.PI / 360));
      if (at.z < 1 && apart < Math.max(reach, size) && apart < least) [nearest, least] = [thing, apart];
    }
    return nearest;
  }

  #onPlane(event) {
    this.#ray.setFromCamera(this.#pointer(event).at, this.#stage.camera);
    return this.#ray.ray.intersectPlane(this.#plane, new THREE.Vector3());
  }

  // A thing moves in the plane through it that faces the camera; if it swings, the middle of that
  // moves.
  #grab(thing, event) {
    this.#held = thing;
    this.#pointerId = event.pointerId;
    const towards = this.#stage.camera.getWorldDirection(new THREE.Vector3());
    this.#plane.setFromNormalAndCoplanarPoint(towards, thing.object.position);
    const at = this.#onPlane(event);
    this.#offset.copy(thing.home).sub(at ?? thing.home);
  }

  #drag(event) {
    const at = this.#onPlane(event);
    if (at) this.#stage.move(this.#held, at.add(this.#offset));
  }

  #moveByKey(event) {
    const { chosen, camera, controls, size } = this.#stage;
    const axes = {
      ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
      PageUp: [0, 0, -1], PageDown: [0, 0, 1],
    };
    const axis = axes[event.key];
    if (!axis) return;
    event.preventDefault();
    if (event.shiftKey) {
      turn(camera, controls.target, axis);
    } else if (chosen) {
      const step = new THREE.Vector3(...axis).applyQuaternion(camera.quaternion);
      this.#stage.move(chosen, chosen.home.clone().addScaledVector(step, size / 40));
    }
  }
}

/** Turns the view around its target by a twentieth of a radian, or comes closer. */
function turn(camera, target, [right, up, back]) {
  const from = new THREE.Spherical().setFromVector3(camera.position.clone().sub(target));
  from.theta += right / 20;
  from.phi -= up / 20;
  from.radius *= 1 + back / 20;
  from.makeSafe();
  camera.position.setFromSpherical(from).add(target);
}
