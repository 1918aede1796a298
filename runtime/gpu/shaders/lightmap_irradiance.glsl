#version 430
// The indirect irradiance at the texels of the lightmap, at least 0: interpolated between the
// vertices of their triangles, with what rows of texels add.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer VertexValues { float vertex_values[]; };
layout(std430, binding = 1) readonly buffer Texels { uint texels[]; };      // triangle, or 0xFFFFFFFF
layout(std430, binding = 2) readonly buffer Weights { vec2 weights[]; };    // of second, third vertex
layout(std430, binding = 3) readonly buffer Triangles { uint triangles[]; };  // three vertices each
layout(std430, binding = 4) readonly buffer Added { float added[]; };  // [texels][3], if rows are
layout(std430, binding = 5) writeonly buffer Lightmap { float lightmap[]; };

vec3 value_at(uint vertex) {
  return vec3(vertex_values[3u * vertex], vertex_values[3u * vertex + 1u], vertex_values[3u * vertex + 2u]);
}

void main() {
  uint texel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (texel >= range.x) return;
  uint triangle = texels[texel];
  vec3 value = vec3(0.0);
  if (triangle != 0xFFFFFFFFu) {
    vec2 weight = weights[texel];
    value = (1.0 - weight.x - weight.y) * value_at(triangles[3u * triangle]) +
            weight.x * value_at(triangles[3u * triangle + 1u]) +
            weight.y * value_at(triangles[3u * triangle + 2u]);
  }
  uint own = 3u * texel;
  if (own + 2u < uint(added.length())) value += vec3(added[own], added[own + 1u], added[own + 2u]);
  for (uint c = 0u; c < 3u; ++c) lightmap[own + c] = max(value[c], 0.0);
}
