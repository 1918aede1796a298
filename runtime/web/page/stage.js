// What is on the canvas: a scene that Rebounce lights, its lamps, and the camera.

import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { RectAreaLightUniformsLib } from 'three/addons/lights/RectAreaLightUniformsLib.js';
import { TransferLighting } from '../library/transfer_lighting.js';
import { Ball } from './ball.js';
import { Lamp } from './lamp.js';
import { SkyDome } from './sky_dome.js';
import { sunAndSky } from './sun.js';

export const mostLamps = 4;

const ground = '#101114';  // as the style sheet's

export class Stage {
  lamps = [];
  chosen = null;
  ball = null;
  comparison = null;
  dome = null;
  swinging = false;
  hour = null;
  sunIsOn = true;
  skyIsOn = true;
  covered = { above: 0, below: 0, right: 0 };  // pixels of the canvas
  part = 'all';  // of the light
  #turn = 0;            // of the scene that was asked for last
  #comparisonTurn = 0;  // of the comparison, or none, that was asked for last

  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.toneMapping = THREE.AgXToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.setClearColor(ground);
    RectAreaLightUniformsLib.init();
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.sun = new THREE.DirectionalLight();
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.bias = -0.0002;
    this.begun = performance.now();
  }

  /**
   * Shows another scene; the one before stays until this one is there.
   * @returns {Promise<boolean>} false if a later call came before the file, or before it failed
   */
  async load(description, url, onProgress) {
    const turn = ++this.#turn;
    const lighting = await TransferLighting.load(url, { onProgress }).catch((error) => {
      if (turn === this.#turn) throw error;
      return null;
    });
    if (turn !== this.#turn) {
      lighting?.dispose();
      return false;
    }
    this.#clear();
    this.lighting = lighting;
    this.description = description;
    this.hour = description.hour ?? null;
    this.scene.add(lighting.mesh);
    if (description.darkEmitters) this.#darken();
    lighting.mesh.geometry.computeBoundingSphere();
    lighting.mesh.geometry.computeBoundingBox();
    this.bounds = lighting.mesh.geometry.boundingBox;
    this.size = lighting.mesh.geometry.boundingSphere.radius;
    this.#placeCamera();
    this.#placeSky();
    this.floor = this.bounds.getCenter(new THREE.Vector3()).setY(this.bounds.min.y);
    for (const lamp of description.lamps) this.addLamp(lamp);
    this.#placeProbes();
    this.setHour(this.hour);
    this.relight();
    this.expose();
    return true;
  }

  #clear() {
    for (const lamp of [...this.lamps]) this.removeLamp(lamp);
    this.closeComparison();
    this.chosen = null;
    if (this.ball) {
      this.scene.remove(this.ball.object, this.lighting.probes);
      this.ball.dispose();
      this.ball = null;
    }
    if (this.lighting) {
      this.scene.remove(this.lighting.mesh);
      this.lighting.dispose();
    }
    this.scene.remove(this.sun, this.sun.target);
    if (this.dome) {
      this.scene.remove(this.dome.object);
      this.dome.dispose();
      this.dome = null;
    }
  }

  #darken() {
    this.lighting.mesh.material.forEach((material, k) => {
      if (material.emissive.getHex() === 0) return;
      this.lighting.engine.setEmissionScale(k, [0, 0, 0]);
      material.emissive.set(0);
    });
  }

  /** A ball among the probes, where the file has some. */
  #placeProbes() {
    if (!this.lighting.probes) return;
    this.ball = new Ball(this.description.ball);
    this.scene.add(this.ball.object, this.lighting.probes);
  }

  #placeCamera() {
    const { camera: position, target, fov } = this.description;
    const [given] = this.lighting.transfer.cameras;
    this.camera.near = this.size / 200;
    this.camera.far = this.size * 20;
    this.fov = fov ?? THREE.MathUtils.radToDeg(given.verticalFov);
    this.camera.position.set(...(position ?? given.position));
    const middle = this.bounds.getCenter(new THREE.Vector3());
    if (target) {
      this.controls.target.set(...target);
    } else {
      const backward = new THREE.Vector3(...given.backward);
      const distance = Math.max(0.5, this.camera.position.distanceTo(middle));
      this.controls.target.copy(this.camera.position).addScaledVector(backward, -distance);
    }
    this.controls.update();
    this.resize();
  }

  /** Sun and sky, where the scene has a time of day. */
  #placeSky() {
    if (this.hour === null) return;
    this.dome = new SkyDome(6 * this.size);
    this.bounds.getCenter(this.dome.object.position);
    this.scene.add(this.dome.object);
    const { camera } = this.sun.shadow;
    camera.left = camera.bottom = -this.size;
    camera.right = camera.top = this.size;
    camera.far = 4 * this.size;
    camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = this.size / 500;
    this.sun.target.position.copy(this.bounds.getCenter(new THREE.Vector3()));
    this.scene.add(this.sun, this.sun.target);
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    const [{ width, height }] = this.views();
    // In one view the scene stands in the middle of what is not covered.
    const { above, below, right } = this.comparison || !this.#leavesRoom()
        ? { above: 0, below: 0, right: 0 } : this.covered;
    const [across, down] = [width - right, height - above - below];
    this.camera.aspect = across / down;
    // A narrow picture shows as much from side to side as a square one.
    const half = Math.tan(THREE.MathUtils.degToRad((this.fov ?? 50) / 2));
    const wider = Math.max(1, 1 / this.camera.aspect);
    this.camera.fov = THREE.MathUtils.radToDeg(2 * Math.atan(half * wider));
    this.camera.setViewOffset(across, down, 0, -above, width, height);
  }

  #leavesRoom() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { above, below, right } = this.covered;
    return height - above - below > height / 3 && width - right > width / 3;
  }

  /** The parts of the canvas that show the scene, in pixels from its upper left: one, or two. */
  views() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!this.comparison) return [{ left: 0, top: 0, width: clientWidth, height: clientHeight }];
    const { above, right, below } =
        this.#leavesRoom() ? this.covered : { above: 0, right: 0, below: 0 };
    const [width, height] = [clientWidth - right, clientHeight - above - below];
    const isWide = width > height;
    const half = isWide ? { width: width / 2, height } : { width, height: height / 2 };
    return [
      { left: 0, top: above, ...half },
      { left: isWide ? half.width : 0, top: isWide ? above : above + half.height, ...half },
    ];
  }

  /**
   * Shows something beside, by one of the classes of comparisons with its settings; the form factors
   * of what has converged are another file.
   * @returns {Promise<boolean>} false if another, none or another scene was asked for before the
   *   file came, or before it failed
   */
  async openComparison(Comparison, settings, url, onProgress) {
    const turn = ++this.#comparisonTurn;
    const solver = await this.lighting.transfer.loadSolver(url, { onProgress }).catch((error) => {
      if (turn === this.#comparisonTurn) throw error;
      return null;
    });
    if (turn !== this.#comparisonTurn) {
      solver?.dispose();
      return false;
    }
    this.closeComparison();
    this.comparison = new Comparison(this, solver, settings);
    for (const object of this.comparison.objects) object.visible = false;
    this.scene.add(...this.comparison.objects);
    if (!this.movable.includes(this.chosen)) this.chosen = this.lamps.at(-1) ?? null;
    this.resize();
    return true;
  }

  closeComparison() {
    ++this.#comparisonTurn;
    if (!this.comparison) return;
    this.scene.remove(...this.comparison.objects);
    this.comparison.dispose();
    this.comparison = null;
    this.resize();
  }

  addLamp(description) {
    if (this.lamps.length >= mostLamps) return;
    const { size, floor } = this;
    const lamp = new Lamp(description, { lampRadius: this.description.lampRadius, size, floor });
    this.lamps.push(lamp);
    this.scene.add(lamp.object);
    if (lamp.target) this.scene.add(lamp.target);
    this.chosen = lamp;
  }

  removeLamp(lamp) {
    this.lamps.splice(this.lamps.indexOf(lamp), 1);
    this.scene.remove(lamp.object);
    if (lamp.target) this.scene.remove(lamp.target);
    lamp.dispose();
    if (this.chosen === lamp) this.chosen = this.lamps.at(-1) ?? null;
  }

  // Probes of the file hold our light alone.
  get #showsBall() {
    return this.ball !== null && this.comparison?.kind !== 'gauss-seidel';
  }

  /** Lamps, and the ball where there is one. */
  get things() {
    return this.ball ? [...this.lamps, this.ball] : this.lamps;
  }

  /** What can be dragged. */
  get movable() {
    return this.#showsBall ? this.things : this.lamps;
  }

  // Changes a position of a lamp or the ball to the nearest that is within the scene.
  #keepInside(thing, position) {
    const margin = thing === this.ball
        ? this.description.ball.radius : 1.5 * this.description.lampRadius;
    position.clamp(
        this.bounds.min.clone().addScalar(margin), this.bounds.max.clone().subScalar(margin));
  }

  /** Moves a lamp or the ball to `position`, or as near to it as the scene reaches. */
  move(thing, position) {
    this.#keepInside(thing, thing.home.copy(position));
    thing.object.position.copy(thing.home);
  }

  /** Lets lamps swing around where they are, or leaves them where they have come to. */
  toggleSwing() {
    this.swinging = !this.swinging;
    for (const { home, object } of this.things) home.copy(object.position);
  }

  /** Sets sun and sky; null: neither. */
  setHour(hour) {
    this.hour = hour;
    this.sky = {};
    this.sun.intensity = 0;
    this.sun.castShadow = false;
    if (hour === null) return;
    const { sun, sky } = sunAndSky(hour);
    this.dome.object.visible = this.skyIsOn;
    if (this.skyIsOn) {
      this.sky = sky;
      this.dome.paint(this.lighting.engine, sky);
    }
    if (!sun || !this.sunIsOn) return;
    this.sun.intensity = sun.intensity;
    this.sun.castShadow = true;
    this.sun.color.setRGB(...sun.color);
    this.sun.position.copy(this.sun.target.position)
        .addScaledVector(new THREE.Vector3(...sun.direction).normalize(), -2 * this.size);
  }

  /** Shows 'all' light, or 'bounced' or 'direct' light alone. */
  show(part) {
    this.part = part;
    this.ball?.showDirect(part !== 'bounced');
    this.lighting.show(part === 'bounced' ? 0 : 1, part === 'direct' ? 0 : 1);
  }

  get lights() {
    return [...this.lamps.map((lamp) => lamp.light), ...(this.hour === null ? [] : [this.sun])];
  }

  relight() {
    this.scene.updateMatrixWorld();
    this.lighting.update(this.lights, this.sky);
  }

  /** Chooses the exposure by the light that there is. */
  expose() {
    const light = this.lighting.engine.radiosity();
    const { area } = this.lighting.transfer.patches;
    // By patches, which are small where there is something to see; by area under the sun.
    let sum = 0, byArea = 0, allArea = 0;
    area.forEach((size, k) => {
      const bright = (light[3 * k] + light[3 * k + 1] + light[3 * k + 2]) / 3;
      sum += bright;
      byArea += size * bright;
      allArea += size;
    });
    const mean = Math.max(sum / area.length, byArea / allArea);
    this.renderer.toneMappingExposure = 0.3 * Math.PI / Math.max(mean, 1e-3);
  }

  /** One frame: relights and draws; the milliseconds that the drawing took to ask for. */
  frame() {
    if (this.swinging) {
      const seconds = (performance.now() - this.begun) / 1000;
      this.things.forEach((thing, k) => {
        thing.swing(seconds + 1.3 * k, 0.16 * this.size);
        this.#keepInside(thing, thing.object.position);
      });
    }
    this.controls.update();
    this.relight();
    this.comparison?.update();
    const begin = performance.now();
    this.draw();
    return performance.now() - begin;
  }

  /** Draws what the last frame has lit, in one view or in two. */
  draw() {
    for (const thing of this.things) thing.face(this.camera, thing === this.chosen);
    const views = this.views();
    const { renderer, scene, camera, canvas, comparison } = this;
    if (views.length > 1) {
      renderer.setScissorTest(false);
      renderer.setClearColor(ground);  // a bake has left another
      renderer.clear();
    }
    renderer.setScissorTest(views.length > 1);
    views.forEach(({ left, top, width, height }, k) => {
      const bottom = canvas.clientHeight - top - height;
      renderer.setViewport(left, bottom, width, height);
      renderer.setScissor(left, bottom, width, height);
      const isOther = k === 1;
      this.lighting.mesh.visible = !isOther;
      for (const object of comparison?.objects ?? []) object.visible = isOther;
      if (this.ball) this.ball.object.visible = this.#showsBall;
      const restore = isOther ? comparison.begin() : () => {};
      renderer.shadowMap.autoUpdate = !isOther;
      renderer.render(scene, camera);
      restore();
      for (const object of comparison?.objects ?? []) object.visible = false;
    });
    renderer.shadowMap.autoUpdate = true;
    this.lighting.mesh.visible = true;
  }
}
