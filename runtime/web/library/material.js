// Materials of a transfer file for three.js.

import * as THREE from 'three';
import { RebounceError } from './instance.js';

/** What draws a material with the textures that loadTextures gives. */
export function makeMaterial(material, textures) {
  const isBlended = material.alphaMode === 'blend';
  // What a lamp's glass gives off is in its emission.
  const solid = material.emittedLuminance.some((part) => part > 0) ? 1 : 1 - material.transmission;
  return new THREE.MeshLambertMaterial({
    name: material.name,
    color: new THREE.Color(...material.baseColor),
    emissive: new THREE.Color(...material.emittedLuminance),
    vertexColors: true,
    shadowSide: THREE.FrontSide,  // surfaces have a second side of their own where they show one
    visible: solid >= 0.5,
    ...textures,
    alphaTest: material.alphaMode === 'mask' ? material.alphaCutoff : 0,
    transparent: isBlended,
    opacity: material.alpha * (isBlended ? solid : 1),
  });
}

const wraps = {
  repeat: THREE.RepeatWrapping, clamp: THREE.ClampToEdgeWrapping, mirror: THREE.MirroredRepeatWrapping,
};

// An image for the texture coordinates of this channel.
async function loadTexture(texture, channel, name) {
  if (!texture) return null;
  const image = await createImageBitmap(
      new Blob([texture.image]), { premultiplyAlpha: 'none', colorSpaceConversion: 'none' },
  ).catch((error) => {
    throw new RebounceError(`an image of the material "${name}" cannot be decoded ` +
                            `(${error.message}); replace it and precompute the scene again`);
  });
  const made = new THREE.Texture(image);
  made.channel = channel;
  made.colorSpace = THREE.SRGBColorSpace;
  made.flipY = false;
  [made.wrapS, made.wrapT] = texture.wrap.map((wrap) => wraps[wrap]);
  made.needsUpdate = true;
  return made;
}

/** The textures of a material, decoded; null for those that it lacks. */
export async function loadTextures({ texture, emissiveTexture, name }) {
  const [map, emissiveMap] = await Promise.all(
      [texture, emissiveTexture].map((one, channel) => loadTexture(one, channel, name)));
  return { map, emissiveMap };
}
