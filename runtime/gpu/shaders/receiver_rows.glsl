#version 430
// What rows of receivers, vertices or texels, add to the light there: a work group for each group
// of receivers, whose entries are sets of patches.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer SetLight { vec4 set_light[]; };
layout(std430, binding = 1) readonly buffer Begin { uint begin[]; };        // [groups + 1]
layout(std430, binding = 2) readonly buffer Entries { uvec2 entries[]; };   // set, bits of scale
layout(std430, binding = 3) readonly buffer Receivers { uint receivers[]; };  // [groups][64]
layout(std430, binding = 4) readonly buffer Values { uvec4 values[]; };     // bytes, four entries
layout(std430, binding = 5) writeonly buffer Added { float added[]; };      // [receivers][3]

shared vec3 coefficient[64];

void main() {
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint thread = gl_LocalInvocationID.x;
  if (group >= range.x) return;
  uint last = begin[group + 1u];
  vec3 sum = vec3(0.0);
  for (uint first = begin[group]; first < last; first += 64u) {
    barrier();
    if (first + thread < last) {
      uvec2 entry = entries[first + thread];
      coefficient[thread] = uintBitsToFloat(entry.y) * set_light[entry.x].xyz;
    }
    barrier();
    // Entries are a multiple of four.
    for (uint k = 0u; k < min(64u, last - first); k += 4u) {
      uvec4 bytes = values[(first + k) / 4u * 16u + thread / 4u];
      for (uint e = 0u; e < 4u; ++e) {
        int value = bitfieldExtract(int(bytes[e]), 8 * int(thread & 3u), 8);
        sum += float(value) * coefficient[k + e];
      }
    }
  }
  uint receiver = receivers[group * 64u + thread];
  if (receiver == 0xFFFFFFFFu) return;
  for (uint c = 0u; c < 3u; ++c) added[3u * receiver + c] = sum[c];
}
