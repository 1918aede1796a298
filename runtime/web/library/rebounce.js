// Rebounce in the browser: loads transfer files and relights their scenes.

import { Instance, RebounceError, isSupported } from './instance.js';
import { plainLightSize, triple, writeLight } from './plain_light.js';
import { readSafetensors } from './safetensors.js';

export { RebounceError, isSupported };

const skyCellCount = 146;
const probeFloats = 27;  // of the light at one
const stages = ['direct', 'exitance', 'product', 'radiosity'];

/** Fetches a file whole; `onProgress(part)` is told how much of it has come, in [0, 1]. */
async function fetchWhole(url, onProgress) {
  const refuse = (reason) => {
    throw new RebounceError(`${url} cannot be fetched: ${reason}`);
  };
  const response = await fetch(url).catch((error) => refuse(error.message));
  if (!response.ok) refuse(`the server says ${response.status}`);
  const length = Number(response.headers.get('content-length'));
  const packed = response.headers.has('content-encoding');  // then the length is of other bytes
  const parts = [];
  let size = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read().catch((error) => refuse(error.message));
    if (done) break;
    parts.push(value);
    size += value.byteLength;
    if (length > 0 && !packed) onProgress(Math.min(1, size / length));
  }
  onProgress(1);
  return new Blob(parts).arrayBuffer();
}

/** The bytes of a file, without its packing; of any reason why that fails, one line. */
async function unpacked(buffer, name) {
  const [first, second] = new Uint8Array(buffer, 0, Math.min(2, buffer.byteLength));
  if (first !== 0x1f || second !== 0x8b) return buffer;
  const stream = new Blob([buffer]).stream().pipeThrough(new DecompressionStream('gzip'));
  try {
    return await new Response(stream).arrayBuffer();
  } catch {
    throw new RebounceError(`${name} is damaged or truncated; fetch it again`);
  }
}

/** The file at a URL or in memory, and what messages call it. */
async function bytesOf(source, { onProgress = () => {}, name } = {}) {
  const isBuffer = source instanceof ArrayBuffer;
  const title = name ?? (isBuffer ? 'the file' : String(source));
  const buffer = await unpacked(isBuffer ? source : await fetchWhole(source, onProgress), title);
  return { buffer, title };
}

/** The address of what is there: 0 is that of what has been disposed of. */
function living(address, title, remedy) {
  if (address === 0) throw new RebounceError(`${title} has been disposed of; ${remedy}`);
  return address;
}

/** All that a transfer file holds. */
export class Transfer {
  #instance;
  #address;

  /** Loads a transfer file from a URL or from memory. */
  static async load(source, options) {
    const [{ buffer, title }, instance] =
        await Promise.all([bytesOf(source, options), Instance.get()]);
    return new Transfer(instance, buffer, title);
  }

  constructor(instance, buffer, name) {
    this.#instance = instance;
    const parts = [new Uint8Array(buffer), instance.bytesOfText(name), 4];
    this.#address = instance.lend(parts, (bytes, title, result) => {
      instance.check('rebounce_transfer_read', bytes, buffer.byteLength, title, result);
      return instance.words(result, 1)[0];
    });
    this.name = name;
    try {
      this.#describe(readSafetensors(buffer));
    } catch (error) {
      this.dispose();
      throw error;
    }
  }

  #describe(file) {
    this.mesh = readMesh(file);
    this.materials = readMaterials(file);
    this.cameras = readCameras(file);
    this.probes = readProbes(file);
    this.patches = readPatches(file);
    this.patchCount = this.patches.area.length;
    /** Whether the sky may look different in different directions. */
    this.hasSkyCells = file.tensor('sky.entry_begin') !== null;
    this.seesSky = file.tensor('patch.sky_visibility').some((part) => part > 0.01);
    this.errorMean = Number(file.metadata.error_mean);
  }

  #living() {
    return living(this.#address, this.name, 'load it again');
  }

  /** Makes an engine: one state of the light of this scene. */
  createEngine(settings) {
    return new Engine(this.#instance, this.#living(), this, settings);
  }

  /** Loads the form factors that were written with this file, for Gauss-Seidel. */
  async loadSolver(source, options) {
    const { buffer, title } = await bytesOf(source, options);
    return new Solver(this.#instance, this.#living(), this, buffer, title);
  }

  /**
   * Frees the file's memory, when its engines have been disposed of too. The file makes no engine
   * and no solver then.
   */
  dispose() {
    if (this.#address && !this.#instance.broken) {
      this.#instance.call('rebounce_transfer_release', this.#address);
    }
    this.#address = 0;
  }
}

/** One state of the light of a scene. */
export class Engine {
  #instance;
  #address = 0;
  #file;  // what messages call it
  #lights = { address: 0, capacity: 0 };
  #lightCount = 0;  // of the last frame
  #sky;
  #milliseconds;
  #vertices = {};  // addresses, one for each of the results at vertices
  #patches;
  #chosen;
  #probes;

  constructor(instance, transfer, { name, patchCount, mesh, probes },
              { pointsPerPatch = 8, areaLightSamples = 4, lightCapacity = 16 } = {}) {
    this.#instance = instance;
    this.#file = name;
    this.patchCount = patchCount;
    this.vertexCount = mesh.position.length / 3;
    /** Milliseconds of the stages of the last frame. */
    this.timings = { direct: 0, product: 0, vertices: 0, total: 0 };
    this.probeCount = probes?.valid.length ?? 0;
    const settings = new Uint32Array([16, pointsPerPatch, areaLightSamples, lightCapacity]);
    this.#address = instance.lend([new Uint8Array(settings.buffer), 4], (chosen, result) => {
      instance.check('rebounce_engine_create', transfer, chosen, result);
      return instance.words(result, 1)[0];
    });
    try {
      this.#allocate();
      this.#makeRoom(lightCapacity);
    } catch (error) {
      this.dispose();
      throw error;
    }
  }

  #allocate() {
    const instance = this.#instance;
    this.#sky = instance.allocate(4 * 4);
    this.#milliseconds = instance.allocate(8 * stages.length);
    for (const name of ['bounced', 'direct', 'chosen']) {
      this.#vertices[name] = instance.allocate(12 * this.vertexCount);
    }
    this.#patches = instance.allocate(12 * this.patchCount);
    this.#probes = instance.allocate(4 * probeFloats * this.probeCount + 1);
  }

  #living() {
    return living(this.#address, `the engine of ${this.#file}`, 'make another with createEngine()');
  }

  /** For the solver. */
  get address() {
    return this.#living();
  }

  #makeRoom(count) {
    if (count <= this.#lights.capacity) return;
    const address = this.#instance.allocate(4 * plainLightSize * count);
    let chosen;
    try {
      chosen = this.#instance.allocate(count + 1);
    } catch (error) {
      this.#instance.release(address);
      throw error;
    }
    if (this.#lights.address) {
      this.#instance.release(this.#lights.address);
      this.#instance.release(this.#chosen);
    }
    this.#lights = { address, capacity: count };
    this.#chosen = chosen;
  }

  /** One frame: all that follows from `lights` and `sky`. */
  relight(lights, sky = {}) {
    const address = this.#living();
    this.#makeRoom(lights.length);
    const plain = this.#instance.floats(this.#lights.address, plainLightSize * lights.length);
    lights.forEach((light, k) => writeLight(light, plain, k));
    const color = triple(sky.color ?? [1, 1, 1], 'sky: color');
    this.#instance.floats(this.#sky, 4).set([...color, sky.luminance ?? 0]);
    this.#instance.check('rebounce_web_relight', address, this.#lights.address, lights.length,
                         this.#sky, this.#milliseconds);
    this.#lightCount = lights.length;  // of a frame that was not refused
    const [direct, before, product, after] =
        this.#instance.doubles(this.#milliseconds, stages.length);
    Object.assign(this.timings, { direct, product, total: direct + before + product + after });
    return this.timings;
  }

  /** From the next frame on, the sky looks as the CIE's sky of this type, times its luminance. */
  setSky(type, sunDirection, groundReflectance = 0.2) {
    const address = this.#living();
    const instance = this.#instance;
    const direction = instance.bytesOfFloats(triple(sunDirection, 'setSky: sunDirection'));
    instance.lend([direction, 4 * skyCellCount], (sun, cells) => {
      instance.check('rebounce_cie_sky', type, sun, groundReflectance, cells);
      instance.check('rebounce_engine_set_sky_distribution', address, cells);
    });
  }

  /**
   * What a sky of the CIE looks like, in parts of its luminance: [height][width], rows from below
   * up, columns from -x over +z and +x to -z.
   */
  skyPanorama(type, sunDirection, width, height, groundReflectance = 0.2) {
    this.#living();
    const instance = this.#instance;
    const direction = instance.bytesOfFloats(triple(sunDirection, 'skyPanorama: sunDirection'));
    const parts = [direction, 4 * skyCellCount, 4 * width * height];
    return instance.lend(parts, (sun, cells, texels) => {
      instance.check('rebounce_cie_sky', type, sun, groundReflectance, cells);
      const [ground] = instance.floats(cells, 1);
      instance.check('rebounce_web_sky_panorama', type, sun, ground, width, height, texels);
      return instance.floats(texels, width * height).slice();
    });
  }

  /** From the next frame on, the sky is uniform. */
  setUniformSky() {
    this.#instance.check('rebounce_engine_set_sky_distribution', this.#living(), 0);
  }

  /** From the next frame on, the sky is uniform, and what is below the horizon `ground` times it. */
  setSkyAboveGround(ground) {
    const address = this.#living();
    const parts = this.#instance.bytesOfFloats(Array(skyCellCount).fill(1).fill(ground, 0, 1));
    this.#instance.lend([parts], (cells) => {
      this.#instance.check('rebounce_engine_set_sky_distribution', address, cells);
    });
  }

  /** From the next frame on, the surfaces of a material emit that of the scene times `scale`. */
  setEmissionScale(material, scale) {
    const address = this.#living();
    const numbers = this.#instance.bytesOfFloats(triple(scale, 'setEmissionScale: scale'));
    this.#instance.lend([numbers], (factors) => {
      this.#instance.check('rebounce_engine_set_emission_scale', address, material, factors);
    });
  }

  #result(name) {
    return this.#instance.floats(this.#instance.call(name, this.#living()), 3 * this.patchCount);
  }
  directIrradiance() {
    return this.#result('rebounce_engine_direct_irradiance');
  }
  indirectIrradiance() {
    return this.#result('rebounce_engine_indirect_irradiance');
  }
  radiosity() {
    return this.#result('rebounce_engine_radiosity');
  }

  #atVertices(name, to) {
    const begin = performance.now();
    this.#instance.check(name, this.#living(), to, this.vertexCount);
    this.timings.vertices = performance.now() - begin;
    return this.#instance.floats(to, 3 * this.vertexCount);
  }
  vertexIrradiance() {
    return this.#atVertices('rebounce_engine_vertex_irradiance', this.#vertices.bounced);
  }
  vertexDirectIrradiance() {
    return this.#atVertices('rebounce_engine_vertex_direct_irradiance', this.#vertices.direct);
  }

  /**
   * What arrives at vertices straight from the sky and from those lights of the last frame that are
   * chosen, [lights] of 0 and 1. Once in a frame.
   */
  vertexDirectIrradianceOf(chosen) {
    const address = this.#living();
    if (chosen.length !== this.#lightCount) {
      throw new RebounceError(
          `vertexDirectIrradianceOf: chosen has ${chosen.length} numbers; give one for each of ` +
          `the ${this.#lightCount} lights of the last frame`);
    }
    this.#instance.bytes(this.#chosen, chosen.length).set(chosen);
    this.#instance.check('rebounce_web_chosen_direct', address, this.#chosen, this.#patches,
                         this.#vertices.chosen);
    return this.#instance.floats(this.#vertices.chosen, 3 * this.vertexCount);
  }

  /** The same at patches, [n][3], of the last call of vertexDirectIrradianceOf. */
  chosenDirectIrradiance() {
    this.#living();
    return this.#instance.floats(this.#patches, 3 * this.patchCount);
  }

  /** The light at probes: harmonics of degree 0 to 2, [probeCount][9][3], cd/m². */
  probeLight() {
    this.#instance.check('rebounce_engine_probe_light', this.#living(), this.#probes,
                         this.probeCount);
    return this.#instance.floats(this.#probes, probeFloats * this.probeCount);
  }

  /** Frees the engine's memory; all other calls throw RebounceError then. */
  dispose() {
    if (this.#address && !this.#instance.broken) {
      this.#instance.call('rebounce_engine_destroy', this.#address);
      for (const address of [
        this.#lights.address, this.#chosen, this.#sky, this.#milliseconds, this.#patches,
        this.#probes, ...Object.values(this.#vertices),
      ]) {
        this.#instance.release(address);
      }
    }
    this.#address = 0;
  }
}

/** Gauss-Seidel on the form factors of a second file, from frame to frame, for comparison. */
export class Solver {
  #instance;
  #address;
  #file;  // what messages call it
  #result;
  #vertices;
  #patches;

  constructor(instance, transfer, { mesh, patchCount }, buffer, name) {
    this.#instance = instance;
    this.#file = name;
    this.patchCount = patchCount;
    this.vertexCount = mesh.position.length / 3;
    const parts = [new Uint8Array(buffer), instance.bytesOfText(name), 4];
    this.#address = instance.lend(parts, (bytes, title, result) => {
      instance.check('rebounce_web_solver_create', transfer, bytes, buffer.byteLength, title, result);
      return instance.words(result, 1)[0];
    });
    try {
      this.#result = instance.allocate(2 * 8);
      this.#vertices = instance.allocate(12 * this.vertexCount);
      this.#patches = instance.allocate(12 * patchCount);
    } catch (error) {
      this.dispose();
      throw error;
    }
  }

  #living() {
    return living(this.#address, `the solver of ${this.#file}`, 'make another with loadSolver()');
  }

  /**
   * Solves for the light of the engine's last frame until it has converged.
   * @returns {number} how far the engine's indirect light is from that, relative
   */
  converge(engine) {
    this.#instance.check('rebounce_web_solver_converge', this.#living(), engine.address,
                         this.#result);
    return this.#instance.doubles(this.#result, 1)[0];
  }

  /**
   * Sweeps for the light of the engine's last frame, from where the last sweeps ended.
   * @returns {{milliseconds: number, error: number}} of the sweeps alone, and how far their indirect
   *   light is from what has converged
   */
  sweep(engine, count) {
    this.#instance.check('rebounce_web_solver_sweep', this.#living(), engine.address, count,
                         this.#result);
    const [milliseconds, error] = this.#instance.doubles(this.#result, 2);
    return { milliseconds, error };
  }

  /** How far other indirect light of the patches, [n][3], is from what has converged, relative. */
  errorOf(irradiance) {
    const address = this.#living();
    if (irradiance.length !== 3 * this.patchCount) {
      throw new RebounceError(
          `errorOf: irradiance has ${irradiance.length} numbers; give three for each of the ` +
          `${this.patchCount} patches`);
    }
    this.#instance.floats(this.#patches, 3 * this.patchCount).set(irradiance);
    this.#instance.check('rebounce_web_solver_error', address, this.#patches, this.#result);
    return this.#instance.doubles(this.#result, 1)[0];
  }

  vertexIrradiance() {
    this.#instance.check('rebounce_web_solver_vertex_irradiance', this.#living(), this.#vertices,
                         this.vertexCount);
    return this.#instance.floats(this.#vertices, 3 * this.vertexCount);
  }

  /** Frees the solver's memory; all other calls throw RebounceError then. */
  dispose() {
    if (this.#address && !this.#instance.broken) {
      this.#instance.call('rebounce_web_solver_destroy', this.#address);
      for (const address of [this.#result, this.#vertices, this.#patches]) {
        this.#instance.release(address);
      }
    }
    this.#address = 0;
  }
}

function readPatches(file) {
  const [area, centroid, normal] =
      ['area', 'centroid', 'normal'].map((name) => file.tensor(`patch.${name}`));
  return { area, centroid, normal };
}

function readMesh(file) {
  const surfaceCount = file.tensor('mesh.back_triangle').length;
  return {
    position: file.tensor('mesh.position'),
    normal: file.tensor('mesh.normal'),
    texcoord: file.tensor('mesh.base_color_texcoord'),
    emissiveTexcoord: file.tensor('mesh.emissive_texcoord'),
    color: file.tensor('mesh.vertex_color'),
    triangle: file.tensor('mesh.triangle'),
    triangleMaterial: file.tensor('mesh.triangle_material'),
    trianglePatch: file.tensor('mesh.triangle_patch'),
    absorbed: file.tensor('patch.absorbed'),
    surfaceCount,
  };
}

/** The grid of probes; null where there is none. */
function readProbes(file) {
  const grid = file.tensor('probe.grid');
  const position = file.tensor('probe.position');
  if (!grid || grid.some((count) => count === 0)) return null;
  return {
    grid: [...grid], valid: file.tensor('probe.valid'),
    first: [...position.subarray(0, 3)], last: [...position.subarray(-3)],
  };
}

function readMaterials(file) {
  const color = file.tensor('material.base_color');
  const luminance = file.tensor('material.emitted_luminance');
  const [texture, emissiveTexture] =
      ['base_color', 'emissive'].map((name) => file.tensor(`material.${name}_texture`));
  const alphaMode = file.tensor('material.alpha_mode');
  const cutoff = file.tensor('material.alpha_cutoff');
  const alpha = file.tensor('material.base_alpha');
  const transmission = file.tensor('material.transmission');
  const wraps = [file.tensor('texture.wrap_s'), file.tensor('texture.wrap_t')];
  const names = JSON.parse(file.metadata.names ?? '{}').materials ?? [];
  const textureOf = (number) => {
    const image = file.tensor(`texture.${number}`);
    return image && { image, wrap: wraps.map((wrap) => ['repeat', 'clamp', 'mirror'][wrap[number]]) };
  };
  return Array.from(texture, (number, k) => ({
    name: names[k] ?? '',
    baseColor: [...color.subarray(3 * k, 3 * k + 3)],
    emittedLuminance: [...luminance.subarray(3 * k, 3 * k + 3)],
    alphaMode: ['opaque', 'mask', 'blend'][alphaMode[k]],
    alphaCutoff: cutoff[k],
    alpha: alpha[k],
    transmission: transmission[k],
    texture: textureOf(number),
    emissiveTexture: textureOf(emissiveTexture[k]),
  }));
}

function readCameras(file) {
  const fov = file.tensor('camera.vertical_fov');
  const vector = (name, k) => [...file.tensor(`camera.${name}`).subarray(3 * k, 3 * k + 3)];
  return Array.from(fov, (verticalFov, k) => ({
    verticalFov,
    position: vector('position', k),
    up: vector('up', k),
    backward: vector('backward', k),
  }));
}
