#version 430
// The indirect irradiance at vertices: sums of weights times those of patches, at least 0 where
// that is asked for, with what rows of vertices add.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items; the last: whether negative sums stay
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer IndirectIrradiance { float indirect_irradiance[]; };
layout(std430, binding = 1) readonly buffer Begin { uint begin[]; };      // [vertices + 1]
layout(std430, binding = 2) readonly buffer Weights { uvec2 weights[]; };  // patch, bits of weight
layout(std430, binding = 3) readonly buffer Added { float added[]; };  // [vertices][3], if rows are
layout(std430, binding = 4) writeonly buffer VertexIrradiance { float vertex_irradiance[]; };

void main() {
  uint vertex = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (vertex >= range.x) return;
  uint own = 3u * vertex;
  vec3 sum = vec3(0.0);
  if (own + 2u < uint(added.length())) sum = vec3(added[own], added[own + 1u], added[own + 2u]);
  for (uint k = begin[vertex]; k < begin[vertex + 1u]; ++k) {
    uint first = 3u * weights[k].x;
    vec3 value = vec3(indirect_irradiance[first], indirect_irradiance[first + 1u], indirect_irradiance[first + 2u]);
    sum += uintBitsToFloat(weights[k].y) * value;
  }
  for (uint c = 0u; c < 3u; ++c) {
    vertex_irradiance[own + c] = range.w != 0u ? sum[c] : max(sum[c], 0.0);
  }
}
