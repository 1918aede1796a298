// The add-on for three.js, without drawing. Usage: node test_three.mjs FOLDER

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { root, skipWithout, web } from './support.mjs';

const folder = process.argv[2];
skipWithout(join(folder, 'native.csv'), 'module; see the test WebBuild');

// What three.js's loaders find in a browser.
globalThis.ProgressEvent ??= class extends Event {};

const THREE = await import(join(web, 'node_modules/three/build/three.module.js'));
const { GLTFLoader } = await import(join(web, 'node_modules/three/examples/jsm/loaders/GLTFLoader.js'));
const { RebounceError, Transfer } = await import(join(web, 'library/rebounce.js'));
const { TransferLighting, toLight } = await import(join(web, 'library/transfer_lighting.js'));
const { toSky } = await import(join(web, 'library/three_lights.js'));

const bytesOf = (path) => new Uint8Array(readFileSync(path)).buffer;
const load = (name) => TransferLighting.load(
    bytesOf(join(folder, name === 'pavilion' ? '' : 'page/scenes', `${name}.safetensors`)), { name });
async function sceneOf(name) {
  const text = readFileSync(join(root, `tests/scenes/${name}.gltf`), 'utf8');
  return (await new GLTFLoader().parseAsync(text, '')).scene;
}
const meshesOf = (object) => {
  const found = [];
  object.traverse((one) => {
    if (one.isMesh) found.push(one);
  });
  return found;
};

function areaOf(mesh) {
  const { attributes: { position }, index } = mesh.geometry;
  mesh.updateWorldMatrix(true, false);
  let area = 0;
  for (let k = 0; k < index.count; k += 3) {
    const [a, b, c] = [0, 1, 2].map((i) =>
        new THREE.Vector3().fromBufferAttribute(position, index.getX(k + i)).applyMatrix4(mesh.matrixWorld));
    area += new THREE.Triangle(a, b, c).getArea();
  }
  return area;
}

for (const name of ['cornell_box', 'furnished_room']) {
  test(`the meshes of ${name} show the light of its file`, async () => {
    const lighting = await load(name);
    const scene = await sceneOf(name);
    const before = meshesOf(scene).map(areaOf);
    lighting.attach(scene);
    const after = meshesOf(scene).map(areaOf);
    // Sides that nothing sees are left out.
    after.forEach((area, k) => assert.ok(area <= before[k] * 1.001, `${area} of ${before[k]}`));
    const sum = (values) => values.reduce((total, value) => total + value, 0);
    assert.ok(sum(after) > 0.8 * sum(before), `${sum(after)} of ${sum(before)}`);

    const lamp = new THREE.PointLight('white', 10);
    lamp.position.copy(new THREE.Box3().setFromObject(scene).getCenter(new THREE.Vector3()));
    lamp.updateMatrixWorld();
    lighting.update([lamp]);
    const at = (geometry, vertex) => ['position', 'bouncedIrradiance'].map(
        (attribute) => new THREE.Vector3().fromBufferAttribute(geometry.attributes[attribute], vertex));
    const shown = new Map();
    const { geometry: own } = lighting.mesh;
    const key = (point) => point.toArray().map((x) => x.toFixed(4)).join();
    for (let v = 0; v < own.attributes.position.count; ++v) {
      const [point, light] = at(own, v);
      shown.set(key(point), [...(shown.get(key(point)) ?? []), light]);
    }
    let lit = 0;
    for (const mesh of meshesOf(scene)) {
      for (let v = 0; v < mesh.geometry.attributes.position.count; ++v) {
        const [point, light] = at(mesh.geometry, v);
        const there = shown.get(key(point.applyMatrix4(mesh.matrixWorld))) ?? [];
        assert.ok(there.some((other) => other.equals(light)), `${mesh.name}, vertex ${v}`);
        if (light.y > 0) ++lit;
      }
      for (const [attribute, { array }] of Object.entries(mesh.geometry.attributes)) {
        assert.ok(array.every(Number.isFinite), attribute);
      }
    }
    assert.ok(lit > 300, `${lit} vertices are lit`);
    lighting.dispose();
  });
}

test('a mesh that does not fit the file is refused, and nothing is changed', async () => {
  const lighting = await load('cornell_box');
  const scene = await sceneOf('cornell_box');
  const [first, ...others] = meshesOf(scene);
  const kept = meshesOf(scene).map((mesh) => mesh.geometry);
  others.at(-1).position.x += 0.05;
  assert.throws(() => lighting.attach(scene), (error) => {
    assert.ok(error instanceof RebounceError);
    assert.match(error.message, /^the mesh ".+" does not fit cornell_box: its triangle \d+, near \(.+\)/);
    return true;
  });
  assert.deepEqual(meshesOf(scene).map((mesh) => mesh.geometry), kept);
  const moving = new THREE.InstancedMesh(first.geometry, first.material, 2);
  assert.throws(() => lighting.attach(moving), /is instanced/);
  lighting.dispose();
});

test('a group without an end is cut as a mesh without groups is', async () => {
  const lighting = await load('cornell_box');
  const [plain, grouped] = [await sceneOf('cornell_box'), await sceneOf('cornell_box')];
  for (const { geometry } of meshesOf(grouped)) {
    geometry.clearGroups();
    geometry.addGroup(0, Infinity, 0);
  }
  for (const scene of [plain, grouped]) lighting.attach(scene);
  assert.deepEqual(meshesOf(grouped).map(areaOf), meshesOf(plain).map(areaOf));
  lighting.dispose();
});

test('a mesh that is far larger than the surface is refused at once', async () => {
  const lighting = await load('cornell_box');
  const far = new THREE.Mesh(new THREE.PlaneGeometry(1e6, 1e6));
  assert.throws(() => lighting.attach(far), /does not fit cornell_box/);
  lighting.dispose();
});

test('attached meshes cast the shadows of the surface', async () => {
  const lighting = await load('cornell_box');
  const scene = await sceneOf('cornell_box');
  const [first] = meshesOf(scene);
  first.material = first.material.clone();
  first.material.shadowSide = THREE.DoubleSide;
  lighting.attach(scene);
  for (const { material: { shadowSide } } of meshesOf(scene).slice(1)) {
    assert.equal(shadowSide, lighting.mesh.material[0].shadowSide);
  }
  assert.equal(first.material.shadowSide, THREE.DoubleSide, 'what was chosen stays');
  lighting.dispose();
});

test('textures are decoded as they are, for their own coordinates; clear glass is not drawn', async (t) => {
  const asked = [];
  globalThis.createImageBitmap = async (_, options) => asked.push(options);
  t.after(() => delete globalThis.createImageBitmap);
  const lighting = await load('textured');
  const [wall, glass] = lighting.mesh.material;
  assert.deepEqual(asked, Array(2).fill({ premultiplyAlpha: 'none', colorSpaceConversion: 'none' }));
  assert.deepEqual([wall.map.channel, wall.emissiveMap.channel, glass.map], [0, 1, null]);
  assert.deepEqual([wall.visible, glass.visible], [true, false]);
  const left = new Set([wall.map, wall.emissiveMap]);
  for (const one of left) one.addEventListener('dispose', () => left.delete(one));
  lighting.dispose();
  assert.equal(left.size, 0);
});

test('an image that cannot be decoded is refused, and leaves nothing in memory', async (t) => {
  globalThis.createImageBitmap = async () => { throw new Error('no image'); };
  t.after(() => delete globalThis.createImageBitmap);
  const { mock } = t.mock.method(Transfer.prototype, 'dispose');
  await assert.rejects(load('textured'), (error) => {
    assert.ok(error instanceof RebounceError);
    assert.match(error.message, /image of the material "wall" .*no image/);
    return true;
  });
  assert.equal(mock.callCount(), 1);
});

test('all that it has made is disposed of with it, and it lights no more', async () => {
  const lighting = await load('cornell_box');
  const scene = await sceneOf('cornell_box');
  lighting.attach(scene);
  const left = new Set([...meshesOf(scene), lighting.mesh, lighting.makeTwin().mesh].flatMap(
      (mesh) => [mesh.geometry, mesh.material].flat()));
  for (const one of left) one.addEventListener('dispose', () => left.delete(one));
  lighting.dispose();
  assert.equal(left.size, 0);
  assert.throws(() => lighting.update([]), (error) => {
    assert.ok(error instanceof RebounceError);
    assert.match(error.message, /engine of cornell_box has been disposed of/);
    return true;
  });
});

test('a light is dark if it or something that it is in is invisible', () => {
  const lamp = new THREE.PointLight('white', 5), over = new THREE.HemisphereLight('white', 'white', 5);
  const group = new THREE.Group().add(new THREE.Group().add(lamp, over));
  const bright = () => [toLight(lamp).intensity, toSky(over).luminance].map((value) => value > 0);
  assert.deepEqual(bright(), [true, true]);
  for (const one of [group, group.children[0]]) {
    one.visible = false;
    assert.deepEqual(bright(), [false, false]);
    one.visible = true;
  }
  lamp.visible = over.visible = false;
  assert.deepEqual(bright(), [false, false]);
});

test('all lights of three.js that stand in a scene are taken', () => {
  const types = [
    new THREE.PointLight(), new THREE.SpotLight(), new THREE.DirectionalLight(),
    new THREE.RectAreaLight(), new THREE.AmbientLight(),
  ].map((light) => toLight(light)?.type);
  assert.deepEqual(types, ['point', 'spot', 'directional', 'rectangle', undefined]);
});

test('a lamp that does not decay with the square is refused', () => {
  const lamp = new THREE.SpotLight('white', 5, 0, 0.5, 0, 1);
  lamp.name = 'key';
  assert.throws(() => toLight(lamp), (error) => {
    assert.ok(error instanceof RebounceError);
    assert.match(error.message, /"key" has a decay of 1; set it to 2/);
    return true;
  });
});

test('a hemisphere light is a sky above a ground', async () => {
  const lighting = await load('pavilion');
  const directUnder = (light) => {
    lighting.update([light]);
    return lighting.engine.directIrradiance().slice();
  };
  const { normal } = lighting.transfer.patches;
  const white = directUnder(new THREE.HemisphereLight('white', 'white', 100));
  const dark = directUnder(new THREE.HemisphereLight('white', 'black', 100));
  const mean = (light, chosen) => {
    const values = [...light].filter((_, k) => chosen(normal[k - k % 3 + 1]));
    return values.reduce((sum, value) => sum + value, 0) / values.length;
  };
  const upright = (y) => Math.abs(y) < 0.1, up = (y) => y > 0.9;
  assert.ok(mean(white, up) > 1);
  assert.ok(Math.abs(mean(white, up) - mean(dark, up)) < 1e-3 * mean(white, up), 'what faces up');
  assert.ok(mean(dark, upright) < 0.99 * mean(white, upright), 'walls see the ground');
  const sky = { luminance: 100 / Math.PI };
  lighting.update([], sky);
  const uniform = lighting.engine.directIrradiance().slice();
  lighting.update([], { ...sky, type: 12, sunDirection: [0, -1, 0] });
  assert.notDeepEqual(lighting.engine.directIrradiance().slice(), uniform);
  lighting.update([], sky);
  assert.deepEqual(lighting.engine.directIrradiance().slice(), uniform, 'a sky leaves no trace');
  for (let k = 0; k < 2; ++k) {
    assert.throws(() => lighting.update([], { ...sky, type: 99, sunDirection: [0, -1, 0] }),
                  RebounceError, `frame ${k}`);
  }
  lighting.dispose();
});
