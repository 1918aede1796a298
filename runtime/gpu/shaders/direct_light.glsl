#version 430
// The light of up to four lamps at the patches, added to what other runs have written: eight threads
// for each patch, whose sums over its points are added in a fixed order.
layout(local_size_x = 64) in;

struct View {
  mat4 texture_from_world;  // (x, y, z, 1) to (u, v, depth, 1) times a positive number
  vec4 layer;               // of a texture of layers
};
struct Lamp {
  uvec4 kind;        // 1 point or spot, 2 directional; shadow map: 0 none, 1 plane, 2 layers, 3 cube;
                     // views
  vec4 position;     // metres; 1 / range^2, 0 without one
  vec4 direction;    // unit, the way of the light; cosine of the outer angle of the cone
  vec4 color;        // times intensity; 1 / (cosine of the inner angle - that of the outer)
  vec4 depth_range;  // 1 / metres at depth 0, 1 / metres at depth 1 (cube); texels off the surface
  View views[8];
};
layout(std140, binding = 8) uniform Lamps {
  uvec4 range;  // patches, points of each, lamps, what comes before: 0 this buffer, 1 nothing, 2 others
  uvec4 runs;   // the first number of the output, runs that are added, numbers of each
  Lamp lamps[4];
};
// [patch][point]: position, and unit normal.
layout(std430, binding = 0) readonly buffer Points { vec4 points[]; };
layout(std430, binding = 1) buffer DirectIrradiance { float direct_irradiance[]; };
layout(std430, binding = 2) readonly buffer Others { float others[]; };
layout(std430, binding = 3) readonly buffer Runs { float of_runs[]; };  // [run][patch][3]
layout(binding = 4) uniform sampler2DShadow plane_maps[4];
layout(binding = 8) uniform sampler2DArrayShadow layer_maps[4];
layout(binding = 12) uniform samplerCubeShadow cube_maps[4];

shared vec3 parts[64];

// The part of the light that is not in shadow, by the depth of the cube around the lamp.
float cube_visibility(uint lamp, vec3 point, vec3 normal) {
  vec3 way = point - lamps[lamp].position.xyz;
  float texel = 2.0 / float(textureSize(cube_maps[lamp], 0).x);
  way += lamps[lamp].depth_range.z * texel * max(max(abs(way.x), abs(way.y)), abs(way.z)) * normal;
  float metres = max(max(abs(way.x), abs(way.y)), abs(way.z));
  float depth = (1.0 / metres - lamps[lamp].depth_range.x) / (lamps[lamp].depth_range.y - lamps[lamp].depth_range.x);
  return texture(cube_maps[lamp], vec4(way, clamp(depth, 0.0, 1.0)));
}

// The same by the first view that has the point; beyond all of them nothing is in shadow.
float view_visibility(uint lamp, vec3 point, vec3 normal) {
  vec2 size = lamps[lamp].kind.y == 1u ? vec2(textureSize(plane_maps[lamp], 0)) : vec2(textureSize(layer_maps[lamp], 0).xy);
  for (uint k = 0u; k < lamps[lamp].kind.z; ++k) {
    mat4 matrix = lamps[lamp].views[k].texture_from_world;
    vec4 at = matrix * vec4(point, 1.0);
    if (at.w <= 0.0) continue;
    // How far the texture moves with the point, in texels per metre.
    mat4 rows = transpose(matrix);
    vec2 moves = size / at.w * vec2(length(rows[0].xyz - at.x / at.w * rows[3].xyz),
                                    length(rows[1].xyz - at.y / at.w * rows[3].xyz));
    at = matrix * vec4(point + lamps[lamp].depth_range.z / max(min(moves.x, moves.y), 1e-12) * normal, 1.0);
    vec3 place = at.xyz / at.w;
    if (at.w <= 0.0 || any(lessThan(place, vec3(0.0))) || any(greaterThan(place, vec3(1.0)))) continue;
    if (lamps[lamp].kind.y == 1u) return texture(plane_maps[lamp], place);
    return texture(layer_maps[lamp], vec4(place.xy, lamps[lamp].views[k].layer.x, place.z));
  }
  return 1.0;
}

// What arrives at a point for a lamp of intensity 1, without shadow.
float unshadowed(uint lamp, vec3 point, vec3 normal) {
  if (lamps[lamp].kind.x == 2u) return max(-dot(normal, lamps[lamp].direction.xyz), 0.0);
  vec3 to_lamp = lamps[lamp].position.xyz - point;
  float squared = max(dot(to_lamp, to_lamp), 1e-12);
  vec3 way = to_lamp * inversesqrt(squared);
  float ratio = squared * lamps[lamp].position.w;
  float inside = clamp((-dot(way, lamps[lamp].direction.xyz) - lamps[lamp].direction.w) * lamps[lamp].color.w, 0.0, 1.0);
  return max(dot(normal, way), 0.0) / squared * max(1.0 - ratio * ratio, 0.0) * inside * inside;
}

// What arrives at a point from a lamp of intensity 1.
float irradiance_at(uint lamp, vec3 point, vec3 normal) {
  float strength = unshadowed(lamp, point, normal);
  uint map = lamps[lamp].kind.y;
  if (strength <= 0.0 || map == 0u) return strength;
  return strength * (map == 3u ? cube_visibility(lamp, point, normal) : view_visibility(lamp, point, normal));
}

void main() {
  uint item = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint thread = gl_LocalInvocationID.x, lane = thread % 8u, patch_index = 8u * item + thread / 8u;
  vec3 sum = vec3(0.0);
  if (patch_index < range.x) {
    for (uint k = lane; k < range.y; k += 8u) {
      uint at = 2u * (range.y * patch_index + k);
      vec3 point = points[at].xyz, normal = points[at + 1u].xyz;
      for (uint lamp = 0u; lamp < range.z; ++lamp)
        sum += irradiance_at(lamp, point, normal) * lamps[lamp].color.xyz;
    }
  }
  parts[thread] = sum;
  barrier();
  if (lane != 0u || patch_index >= range.x) return;
  for (uint k = 1u; k < 8u; ++k) sum += parts[thread + k];
  sum /= float(range.y);
  for (uint c = 0u; c < 3u; ++c) {
    uint at = 3u * patch_index + c, own = runs.x + at;
    float before = range.w == 0u ? direct_irradiance[own] : range.w == 2u ? others[at] : 0.0;
    for (uint run = 0u; run < runs.y; ++run) before += of_runs[run * runs.z + at];
    direct_irradiance[own] = before + sum[c];
  }
}
