// What light_probe_grid.mjs runs in the browser: one scene, lit by Rebounce or by a grid of probes.

import * as THREE from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { TransferLighting } from '../../runtime/web/library/transfer_lighting.js';
import { GridLight } from '../../runtime/web/page/grid_light.js';

const probesPerFrame = 4;  // as three.js's example of a large scene
const right = 0.05;

const lighting = await TransferLighting.load('scene.safetensors');
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(innerWidth, innerHeight);
renderer.shadowMap.enabled = true;
renderer.toneMapping = THREE.AgXToneMapping;
document.body.style.margin = 0;
document.body.append(renderer.domElement);

const scene = new THREE.Scene();
const [camera] = lighting.transfer.cameras.map(() => new THREE.PerspectiveCamera(60, innerWidth / innerHeight, 0.05, 50));
camera.position.set(7.6, 1.5, 2.9);
camera.lookAt(4.2, 1.1, 1.6);

// For probes: the same surface with three.js's own materials.
const plain = new THREE.Mesh(lighting.mesh.geometry, lighting.mesh.material.map((material) =>
    new THREE.MeshLambertMaterial({ color: material.color, vertexColors: true })));
plain.castShadow = plain.receiveShadow = true;
lighting.mesh.geometry.computeBoundingBox();
const bounds = lighting.mesh.geometry.boundingBox;

const lamps = [];

function draw() {
  renderer.render(scene, camera);
}

window.bench = {
  /** Rebounce's picture. */
  start(lights) {
    for (const { position, color, intensity } of lights) {
      const lamp = new THREE.PointLight(new THREE.Color(...color), intensity);
      lamp.position.set(...position);
      lamp.castShadow = true;
      lamp.shadow.mapSize.set(1024, 1024);
      lamp.shadow.camera.near = 0.05;
      lamp.shadow.bias = -0.00003;
      lamp.shadow.normalBias = 0.006;
      lamps.push(lamp);
      scene.add(lamp);
    }
    scene.add(lighting.mesh);
    scene.updateMatrixWorld();
    lighting.update(lamps);
    const light = lighting.engine.radiosity();
    renderer.toneMappingExposure =
        2 * Math.PI * light.length / light.reduce((sum, value) => sum + value, 0);
    draw();
  },

  /** Bakes a grid after the lamps were switched on: frames until it is right, and its light. */
  bake({ grid: resolution, bounces, points }) {
    scene.remove(lighting.mesh);
    scene.add(plain);
    const size = bounds.getSize(new THREE.Vector3());
    const make = () => {
      const grid = new LightProbeGridWebGL(...size.toArray(), ...resolution);
      bounds.getCenter(grid.position);
      grid.updateBoundingBox();
      return grid;
    };
    const grid = make();
    const reader = new GridLight(grid, points.map(({ position }) => position),
                                 points.map(({ normal }) => normal));
    const valuesOf = (one) => {
      const light = reader.read(renderer, one);
      return points.map((_, k) => [...light.subarray(3 * k, 3 * k + 3)]);
    };
    scene.add(grid);
    grid.bake(renderer, scene, { bounces, near: 0.02, far: 50 });
    const values = valuesOf(grid);
    scene.remove(grid);

    // Frame by frame, from the dark.
    const slow = make();
    scene.add(slow);
    const count = resolution[0] * resolution[1] * resolution[2];
    const perPass = Math.ceil(count / probesPerFrame);
    const isRight = () => {
      let off = 0, all = 0;
      valuesOf(slow).forEach((value, k) => value.forEach((x, c) => {
        off += (x - values[k][c]) ** 2;
        all += values[k][c] ** 2;
      }));
      return Math.sqrt(off / all) < right;
    };
    let frames = 0;
    for (let pass = 0; pass <= bounces; ++pass) {
      for (let start = 0; start < count; start += probesPerFrame) {
        slow.bake(renderer, scene, {
          start, count: Math.min(probesPerFrame, count - start), pass, near: 0.02, far: 50,
        });
        ++frames;
        if (frames % 10 === 0 && pass > 0 && isRight()) break;
      }
      if (isRight()) break;
    }
    draw();
    scene.remove(slow);
    for (const one of [grid, slow]) one.dispose();
    return { frames, perPass, values };
  },
};
