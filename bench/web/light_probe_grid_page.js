// What light_probe_grid.mjs runs in the browser: one scene, lit by Rebounce or by a grid of probes.

import * as THREE from 'three';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { TransferLighting } from '../../runtime/web/library/transfer_lighting.js';

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

/** The four numbers of each texel of a grid's texture. */
function readAtlas(grid) {
  const { x: nx, y: ny, z: nz } = grid.resolution;
  const depth = 7 * (nz + 2);
  const atlas = new Float32Array(4 * nx * ny * depth);
  const gl = renderer.getContext();
  for (let layer = 0; layer < depth; ++layer) {
    renderer.setRenderTarget(grid._renderTarget, layer);
    gl.readPixels(0, 0, nx, ny, gl.RGBA, gl.FLOAT, atlas, 4 * nx * ny * layer);
  }
  renderer.setRenderTarget(null);
  return atlas;
}

/** The irradiance of a grid at a point, as three.js's shader finds it. */
function irradiance(grid, atlas, { position, normal }) {
  const size = grid.resolution.toArray();
  const low = grid.boundingBox.min.toArray(), high = grid.boundingBox.max.toArray();
  const places = size.map((count, c) => {
    const range = high[c] - low[c];
    const at = (position[c] + 0.5 * normal[c] * range / count - low[c]) / range;
    const place = Math.min(Math.max(at * count, 0.5), count - 0.5) - 0.5;
    const first = Math.min(Math.floor(place), count - 1);
    return { first, second: Math.min(first + 1, count - 1), part: place - first };
  });
  const sum = new Float64Array(28);
  for (let corner = 0; corner < 8; ++corner) {
    let weight = 1;
    const [x, y, z] = places.map(({ first, second, part }, c) => {
      const far = (corner >> c) & 1;
      weight *= far ? part : 1 - part;
      return far ? second : first;
    });
    for (let t = 0; t < 7; ++t) {
      const layer = t * (size[2] + 2) + 1 + z;
      for (let c = 0; c < 4; ++c) {
        sum[4 * t + c] += weight * atlas[4 * (x + size[0] * (y + size[1] * layer)) + c];
      }
    }
  }
  const [x, y, z] = normal;
  const basis = [
    0.886227, 2 * 0.511664 * y, 2 * 0.511664 * z, 2 * 0.511664 * x, 2 * 0.429043 * x * y,
    2 * 0.429043 * y * z, 0.743125 * z * z - 0.247708, 2 * 0.429043 * x * z,
    0.429043 * (x * x - y * y),
  ];
  return [0, 1, 2].map((c) => Math.max(0, basis.reduce((all, b, k) => all + b * sum[3 * k + c], 0)));
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
    const valuesOf = (grid) => {
      const atlas = readAtlas(grid);
      return points.map((point) => irradiance(grid, atlas, point));
    };
    const grid = make();
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
