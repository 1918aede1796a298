// Draws the textured scene for test_page.mjs: its wall fills the picture, behind the pane.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { TransferLighting } from '../../../runtime/web/library/transfer_lighting.js';

const size = 64;
const target = new THREE.WebGLRenderTarget(size, size, { type: THREE.FloatType });
const renderer = new THREE.WebGLRenderer();
renderer.shadowMap.enabled = true;
renderer.setRenderTarget(target);
const camera = new THREE.OrthographicCamera(-0.5, 0.5, 0.5, -0.5, 0.1, 2);
camera.position.z = 1;
const scene = new THREE.Scene();

const spot = new THREE.SpotLight('white', 2, 1.1, 0.5, 0.6);
spot.position.set(0, 0, 0.9);
spot.castShadow = true;
spot.shadow.normalBias = 0.02;
const near = new THREE.PointLight('white', 0.01);
near.position.set(0, 0, 0.05);

/** Radiance along the row through the middle, [size][3] in cd/m². */
function draw(lighting, object, ...lamps) {
  scene.add(object, ...lamps);
  scene.updateMatrixWorld();
  lighting.update(lamps);
  renderer.render(scene, camera);
  scene.remove(object, ...lamps);
  const row = new Float32Array(4 * size);
  renderer.readRenderTargetPixels(target, 0, size / 2, size, 1, row);
  return [...row].filter((_, k) => k % 4 < 3);
}

/** The object without lamps, with the spot beyond the pane, and with the lamp near the wall. */
const drawAll = (lighting, object) => ({
  dark: draw(lighting, object), spot: draw(lighting, object, spot), near: draw(lighting, object, near),
});

async function drawBoth() {
  const lighting = await TransferLighting.load('scenes/textured.safetensors');
  lighting.show(1, 0);
  const file = drawAll(lighting, lighting.mesh);
  const { scene: own } = await new GLTFLoader().loadAsync('scenes/textured.gltf');
  lighting.attach(own);
  const [wall, pane] = ['wall', 'pane'].map((name) => own.getObjectByName(name));
  pane.visible = false;  // three.js draws it
  return { file, own: drawAll(lighting, own), casts: [wall.castShadow, pane.castShadow] };
}
window.drawn = drawBoth();
