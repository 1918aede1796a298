#version 430
// Adds the light of one lamp to the direct irradiance of the patches: eight threads for each patch,
// whose sums over its points are added in a fixed order.
layout(local_size_x = 64) in;

struct View {
  mat4 texture_from_world;  // (x, y, z, 1) to (u, v, depth, 1) times a positive number
  vec4 layer;               // of a texture of layers
};
layout(std140, binding = 8) uniform Lamp {
  uvec4 range;       // patches, points of each, what comes before: 0 this buffer, 1 nothing, 2 others
  uvec4 kind;        // 0 none, 1 point or spot, 2 directional; shadow map: 0 none, 1 plane, 2 layers,
                     // 3 cube; views
  vec4 position;     // metres; 1 / range^2, 0 without one
  vec4 direction;    // unit, the way of the light; cosine of the outer angle of the cone
  vec4 color;        // times intensity; 1 / (cosine of the inner angle - that of the outer)
  vec4 depth_range;  // 1 / metres at depth 0, 1 / metres at depth 1 (cube); texels off the surface
  View views[8];
};
// [patch][point]: position, and unit normal.
layout(std430, binding = 0) readonly buffer Points { vec4 points[]; };
layout(std430, binding = 1) buffer DirectIrradiance { float direct_irradiance[]; };
layout(std430, binding = 2) readonly buffer Others { float others[]; };
layout(binding = 10) uniform sampler2DShadow plane_map;
layout(binding = 11) uniform sampler2DArrayShadow layer_map;
layout(binding = 12) uniform samplerCubeShadow cube_map;

shared float parts[64];

// The part of the light that is not in shadow, by the depth of the cube around the lamp.
float cube_visibility(vec3 point, vec3 normal) {
  vec3 way = point - position.xyz;
  float texel = 2.0 / float(textureSize(cube_map, 0).x);
  way += depth_range.z * texel * max(max(abs(way.x), abs(way.y)), abs(way.z)) * normal;
  float metres = max(max(abs(way.x), abs(way.y)), abs(way.z));
  float depth = (1.0 / metres - depth_range.x) / (depth_range.y - depth_range.x);
  return texture(cube_map, vec4(way, clamp(depth, 0.0, 1.0)));
}

// The same by the first view that has the point; beyond all of them nothing is in shadow.
float view_visibility(vec3 point, vec3 normal) {
  vec2 size = kind.y == 1u ? vec2(textureSize(plane_map, 0)) : vec2(textureSize(layer_map, 0).xy);
  for (uint k = 0u; k < kind.z; ++k) {
    mat4 matrix = views[k].texture_from_world;
    vec4 at = matrix * vec4(point, 1.0);
    if (at.w <= 0.0) continue;
    // How far the texture moves with the point, in texels per metre.
    mat4 rows = transpose(matrix);
    vec2 moves = size / at.w * vec2(length(rows[0].xyz - at.x / at.w * rows[3].xyz),
                                    length(rows[1].xyz - at.y / at.w * rows[3].xyz));
    at = matrix * vec4(point + depth_range.z / max(min(moves.x, moves.y), 1e-12) * normal, 1.0);
    vec3 place = at.xyz / at.w;
    if (at.w <= 0.0 || any(lessThan(place, vec3(0.0))) || any(greaterThan(place, vec3(1.0)))) continue;
    if (kind.y == 1u) return texture(plane_map, place);
    return texture(layer_map, vec4(place.xy, views[k].layer.x, place.z));
  }
  return 1.0;
}

// What arrives at a point for a lamp of intensity 1, without shadow.
float unshadowed(vec3 point, vec3 normal) {
  if (kind.x == 2u) return max(-dot(normal, direction.xyz), 0.0);
  vec3 to_lamp = position.xyz - point;
  float squared = max(dot(to_lamp, to_lamp), 1e-12);
  vec3 way = to_lamp * inversesqrt(squared);
  float ratio = squared * position.w;
  float inside = clamp((-dot(way, direction.xyz) - direction.w) * color.w, 0.0, 1.0);
  return max(dot(normal, way), 0.0) / squared * max(1.0 - ratio * ratio, 0.0) * inside * inside;
}

float irradiance_at(uint index) {
  vec3 point = points[2u * index].xyz, normal = points[2u * index + 1u].xyz;
  float strength = unshadowed(point, normal);
  if (strength <= 0.0 || kind.y == 0u) return strength;
  return strength * (kind.y == 3u ? cube_visibility(point, normal) : view_visibility(point, normal));
}

void main() {
  uint item = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint thread = gl_LocalInvocationID.x, lane = thread % 8u, patch_index = 8u * item + thread / 8u;
  float sum = 0.0;
  if (patch_index < range.x && kind.x != 0u) {
    for (uint k = lane; k < range.y; k += 8u) sum += irradiance_at(range.y * patch_index + k);
  }
  parts[thread] = sum;
  barrier();
  if (lane != 0u || patch_index >= range.x) return;
  for (uint k = 1u; k < 8u; ++k) sum += parts[thread + k];
  sum /= float(range.y);
  for (uint c = 0u; c < 3u; ++c) {
    uint at = 3u * patch_index + c;
    float before = range.z == 0u ? direct_irradiance[at] : range.z == 2u ? others[at] : 0.0;
    direct_irradiance[at] = before + sum * color[c];
  }
}
