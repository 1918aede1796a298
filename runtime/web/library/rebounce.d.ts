/**
 * A lamp or the sun, in the fields, units and defaults of a light file (KHR_lights_punctual). All
 * vectors and colours, here and elsewhere, are three numbers.
 */
export interface Light {
  type?: 'point' | 'spot' | 'directional' | 'sphere' | 'rectangle' | 'disc';
  /** m */
  position?: readonly number[];
  /** The way the light travels; any length but 0. */
  direction?: readonly number[];
  /** Linear Rec.709, at least 0. */
  color?: readonly number[];
  /** cd (point, spot), lx (directional), cd/m² (others). */
  intensity?: number;
  /** m; 0, the default: unlimited. */
  range?: number;
  spot?: { innerConeAngle?: number; outerConeAngle?: number };
  /** m, of a sphere or disc. */
  radius?: number;
  /** m, of a rectangle along `tangent` and across it. */
  width?: number;
  height?: number;
  tangent?: readonly number[];
}

/** What is seen where a scene is open: cd/m². */
export interface Sky {
  color?: readonly number[];
  luminance?: number;
}

/** Milliseconds of the stages of a frame; `total` is without `vertices`. */
export interface Timings {
  direct: number;
  product: number;
  vertices: number;
  total: number;
}

/** The surface of a scene. The first `surfaceCount` triangles stop light. */
export interface Mesh {
  readonly position: Float32Array;
  readonly normal: Float32Array;
  readonly texcoord: Float32Array;
  readonly emissiveTexcoord: Float32Array;
  readonly color: Float32Array;
  readonly triangle: Uint32Array;
  readonly triangleMaterial: Uint32Array;
  /** 2^32 - 1: a side that nothing sees. */
  readonly trianglePatch: Uint32Array;
  /** Of each patch, the part of its view that is inside of solids. */
  readonly absorbed: Float32Array;
  readonly surfaceCount: number;
}

/** What the light of patches is of: [patchCount] m², [patchCount][3] m, [patchCount][3] unit. */
export interface Patches {
  readonly area: Float32Array;
  readonly centroid: Float32Array;
  readonly normal: Float32Array;
}

/** An image in its file format. */
export interface Texture {
  readonly image: Uint8Array;
  readonly wrap: ('repeat' | 'clamp' | 'mirror')[];
}

export interface Material {
  readonly name: string;
  readonly baseColor: number[];
  /** cd/m² */
  readonly emittedLuminance: number[];
  readonly alphaMode: 'opaque' | 'mask' | 'blend';
  readonly alphaCutoff: number;
  readonly alpha: number;
  /** The part of light that passes through, unless it emits. */
  readonly transmission: number;
  readonly texture: Texture | null;
  readonly emissiveTexture: Texture | null;
}

export interface Camera {
  readonly verticalFov: number;
  readonly position: number[];
  readonly up: number[];
  readonly backward: number[];
}

/** A grid of light probes, x fastest, evenly spaced from the first to the last. */
export interface Probes {
  readonly grid: number[];
  /** [probes] 0: inside of something. */
  readonly valid: Uint8Array;
  readonly first: number[];
  readonly last: number[];
}

export interface LoadOptions {
  /** Is told how much of the file has come, in [0, 1]. */
  onProgress?: (part: number) => void;
  /** Stands for the file in messages. */
  name?: string;
}

export interface EngineSettings {
  /** Points of a patch at which lamps are looked at; 8. More: truer shadows, more time. */
  pointsPerPatch?: number;
  /** Places of a lamp with a surface that each point looks at; 4, at most 64. */
  areaLightSamples?: number;
  /** Lights for which there is room at once; 16. */
  lightCapacity?: number;
}

/** What Rebounce refuses: one line that says what is wrong, where, and what to do. */
export class RebounceError extends Error {}

/** Whether this browser runs WebAssembly with SIMD and exceptions. */
export function isSupported(): boolean;

/** All that a transfer file holds. */
export class Transfer {
  /**
   * Loads a file, packed with gzip or not. Throws RebounceError if it is missing, damaged or none of
   * ours.
   */
  static load(source: string | URL | ArrayBuffer, options?: LoadOptions): Promise<Transfer>;
  private constructor();
  readonly mesh: Mesh;
  readonly materials: Material[];
  readonly cameras: Camera[];
  readonly probes: Probes | null;
  /** What messages call the file. */
  readonly name: string;
  readonly patches: Patches;
  readonly patchCount: number;
  /** Whether the sky may look different in different directions. */
  readonly hasSkyCells: boolean;
  /** Whether any patch sees the sky. */
  readonly seesSky: boolean;
  /** The measured error of indirect light, relative. */
  readonly errorMean: number;
  createEngine(settings?: EngineSettings): Engine;
  /** Loads the file of form factors that `precompute --for web` wrote beside this one. */
  loadSolver(source: string | URL | ArrayBuffer, options?: LoadOptions): Promise<Solver>;
  /** Frees the file's memory, when its engines have been disposed of too; it makes no more of them. */
  dispose(): void;
}

/**
 * One state of the light of a scene. Results are views that change with the next frame, each in a
 * place of its own, and may end when a file is loaded.
 */
export class Engine {
  private constructor();
  readonly patchCount: number;
  readonly vertexCount: number;
  readonly probeCount: number;
  readonly timings: Timings;
  /** One frame. Lights are known by their place: one that did not move is not traced again. */
  relight(lights: readonly Light[], sky?: Sky): Timings;
  /** Gives the sky the look of a sky of the CIE, 1 (overcast) to 15; 12 is clear. */
  setSky(type: number, sunDirection: readonly number[], groundReflectance?: number): void;
  /**
   * What such a sky looks like, in parts of its luminance: [height][width], rows from below up,
   * columns from -x over +z and +x to -z.
   */
  skyPanorama(type: number, sunDirection: readonly number[], width: number, height: number,
              groundReflectance?: number): Float32Array;
  /** Makes the sky uniform, as at first. */
  setUniformSky(): void;
  /** Makes it uniform above the horizon, and `ground` times as bright below. */
  setSkyAboveGround(ground: number): void;
  /** Scales what the surfaces of a material emit, from the next frame on. */
  setEmissionScale(material: number, scale: readonly number[]): void;
  /** [patchCount][3], lx */
  directIrradiance(): Float32Array;
  indirectIrradiance(): Float32Array;
  radiosity(): Float32Array;
  /** [vertexCount][3], lx */
  vertexIrradiance(): Float32Array;
  vertexDirectIrradiance(): Float32Array;
  /**
   * [vertexCount][3], lx: straight from the sky and those lights that are chosen, 0 or 1 for each
   * light of the frame; to be called at most once after each frame.
   */
  vertexDirectIrradianceOf(chosen: ArrayLike<number>): Float32Array;
  /** The same at patches, [patchCount][3], of the last call of vertexDirectIrradianceOf. */
  chosenDirectIrradiance(): Float32Array;
  /** [probeCount][9][3], cd/m²: spherical harmonics of degree 0 to 2. */
  probeLight(): Float32Array;
  /** Frees the engine's memory; all other calls throw RebounceError then. */
  dispose(): void;
}

/** What sweeps took, and how far their light is from what has converged, relative. */
export interface Swept {
  milliseconds: number;
  error: number;
}

/** Gauss-Seidel that goes on from its last solution, for comparison. */
export class Solver {
  private constructor();
  readonly patchCount: number;
  readonly vertexCount: number;
  /**
   * Solves for the light of the engine's last frame until it has converged; how far the engine's
   * indirect light is from that: relative, area-weighted L2.
   */
  converge(engine: Engine): number;
  /** How far other indirect light, [patchCount][3] in lx, is from what has converged. */
  errorOf(irradiance: ArrayLike<number>): number;
  /** Sweeps for the light of the engine's last frame. */
  sweep(engine: Engine, count: number): Swept;
  /** [vertexCount][3], lx: the bounced light of the last sweeps. */
  vertexIrradiance(): Float32Array;
  /** Frees the solver's memory; all other calls throw RebounceError then. */
  dispose(): void;
}
