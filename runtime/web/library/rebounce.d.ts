/** A lamp or the sun, in the fields, units and defaults of a light file (KHR_lights_punctual). */
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
  readonly color: Float32Array;
  readonly triangle: Uint32Array;
  readonly triangleMaterial: Uint32Array;
  readonly surfaceCount: number;
}

export interface Material {
  readonly name: string;
  readonly baseColor: number[];
  /** cd/m² */
  readonly emittedLuminance: number[];
  readonly alphaMode: 'opaque' | 'mask' | 'blend';
  readonly alphaCutoff: number;
  readonly alpha: number;
  readonly texture: { image: Uint8Array; wrap: ('repeat' | 'clamp' | 'mirror')[] } | null;
}

export interface Camera {
  readonly verticalFov: number;
  readonly position: number[];
  readonly up: number[];
  readonly backward: number[];
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
  /** Loads a file. Throws RebounceError if it is missing, damaged or none of ours. */
  static load(source: string | URL | ArrayBuffer, options?: LoadOptions): Promise<Transfer>;
  private constructor();
  readonly mesh: Mesh;
  readonly materials: Material[];
  readonly cameras: Camera[];
  readonly patchCount: number;
  /** Whether any patch sees the sky. */
  readonly seesSky: boolean;
  /** The measured error of indirect light, relative. */
  readonly errorMean: number;
  createEngine(settings?: EngineSettings): Engine;
  dispose(): void;
}

/** One state of the light of a scene. Results are views that change with the next frame. */
export class Engine {
  private constructor();
  readonly patchCount: number;
  readonly vertexCount: number;
  readonly timings: Timings;
  /** One frame. Lights are known by their place: one that did not move is not traced again. */
  relight(lights: readonly Light[], sky?: Sky): Timings;
  /** Gives the sky the look of a sky of the CIE, 1 (overcast) to 15; 12 is clear. */
  setSky(type: number, sunDirection: readonly number[], groundReflectance?: number): void;
  /** Scales what the surfaces of a material emit, from the next frame on. */
  setEmissionScale(material: number, scale: readonly number[]): void;
  /** [patchCount][3], lx */
  directIrradiance(): Float32Array;
  indirectIrradiance(): Float32Array;
  radiosity(): Float32Array;
  /** [vertexCount][3], lx */
  vertexIrradiance(): Float32Array;
  vertexDirectIrradiance(): Float32Array;
  dispose(): void;
}
