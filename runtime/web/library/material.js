// Materials of a transfer file for three.js.

import * as THREE from 'three';

export function makeMaterial(material, texture) {
  return new THREE.MeshLambertMaterial({
    name: material.name,
    color: new THREE.Color(...material.baseColor),
    emissive: new THREE.Color(...material.emittedLuminance),
    vertexColors: true,
    shadowSide: THREE.FrontSide,  // surfaces have a second side of their own where they show one
    map: texture,
    alphaTest: material.alphaMode === 'mask' ? material.alphaCutoff : 0,
    transparent: material.alphaMode === 'blend',
    opacity: material.alpha,
  });
}

const wraps = {
  repeat: THREE.RepeatWrapping, clamp: THREE.ClampToEdgeWrapping, mirror: THREE.MirroredRepeatWrapping,
};

export async function loadTexture({ texture }) {
  if (!texture) return null;
  const made = new THREE.Texture(await createImageBitmap(new Blob([texture.image])));
  made.colorSpace = THREE.SRGBColorSpace;
  made.flipY = false;
  [made.wrapS, made.wrapT] = texture.wrap.map((wrap) => wraps[wrap]);
  made.needsUpdate = true;
  return made;
}
