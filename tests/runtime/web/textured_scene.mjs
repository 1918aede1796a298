// A wall with two textures, by two sets of coordinates, a pane of glass before it and a plain wall
// opposite, as glTF.

const uri = (kind, data) => `data:${kind};base64,${data}`;
const wall = [-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0];
const mirrored = [1, 1, 0, 1, 0, 0, 1, 0], upright = [0, 1, 1, 1, 1, 0, 0, 0];
const triangles = [0, 1, 2, 0, 2, 3];

// One half-transparent grey texel; a red texel to the left of a green one.
const grey = 'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mPYs2dPAwAHIQK1Iw4QMQAAAABJRU5ErkJggg==';
const pair = 'iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR42mP4z8DA8J8BAAf/Af+4BDXgAAAAAElFTkSuQmCC';

/** What the wall shows: its reflectance, and what its left and right half emit, cd/m². */
export const reflectance = ((188 / 255 + 0.055) / 1.055) ** 2.4;
export const emitted = [[1, 0, 0], [0, 1, 0]];

const values = [wall, mirrored, upright].map((numbers) => Float32Array.from(numbers));
values.push(Uint16Array.from(triangles));
const bytes = Buffer.concat(values.map(({ buffer }) => Buffer.from(buffer)));
let end = 0;
const bufferViews = values.map(({ byteLength }) => {
  end += byteLength;
  return { buffer: 0, byteOffset: end - byteLength, byteLength };
});
const accessor = (bufferView, type, count, componentType = 5126) =>
    ({ bufferView, componentType, type, count });

export const texturedScene = JSON.stringify({
  asset: { version: '2.0' },
  extensionsUsed: ['KHR_materials_transmission'],
  scene: 0,
  scenes: [{ nodes: [0, 1, 2] }],
  nodes: [
    { mesh: 0, name: 'wall' }, { mesh: 1, name: 'pane', translation: [0, 0, 0.5] },
    { mesh: 2, translation: [0, 0, 1.2], rotation: [0, 1, 0, 0] },
  ],
  meshes: [0, 1, 2].map((material) => ({
    primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1, TEXCOORD_1: 2 }, indices: 3, material }],
  })),
  materials: [
    {
      name: 'wall', emissiveFactor: [1, 1, 1], emissiveTexture: { index: 1, texCoord: 1 },
      pbrMetallicRoughness: { baseColorTexture: { index: 0 }, metallicFactor: 0 },
    },
    {
      name: 'glass', doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0.5, 0.5, 0.5, 1] },
      extensions: { KHR_materials_transmission: { transmissionFactor: 0.8 } },
    },
    { name: 'plain', pbrMetallicRoughness: { baseColorFactor: [0.5, 0.5, 0.5, 1] } },
  ],
  textures: [{ source: 0 }, { source: 1 }],
  images: [{ uri: uri('image/png', grey) }, { uri: uri('image/png', pair) }],
  accessors: [
    { ...accessor(0, 'VEC3', 4), min: [-0.5, -0.5, 0], max: [0.5, 0.5, 0] },
    accessor(1, 'VEC2', 4), accessor(2, 'VEC2', 4), accessor(3, 'SCALAR', 6, 5123),
  ],
  bufferViews,
  buffers: [{ uri: uri('application/octet-stream', bytes.toString('base64')), byteLength: bytes.length }],
});
