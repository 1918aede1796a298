#version 430
// M0 = rho E + Me by patch, and the input of the operator: M0 times the root of the area, in the
// operator's order of positions.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) readonly buffer DirectIrradiance { float direct_irradiance[]; };
layout(std430, binding = 1) readonly buffer Reflectance { float reflectance[]; };
layout(std430, binding = 2) readonly buffer EmittedExitance { float emitted_exitance[]; };
// The patch at each position, or 0xFFFFFFFF, and the weight of its light.
layout(std430, binding = 3) readonly buffer Positions { uvec2 positions[]; };
layout(std430, binding = 4) writeonly buffer InitialExitance { float initial_exitance[]; };
layout(std430, binding = 5) writeonly buffer Light { vec4 light[]; };

void main() {
  uint position = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (position >= range.x) return;
  uvec2 entry = positions[position];
  vec3 sum = vec3(0.0);
  if (entry.x != 0xFFFFFFFFu) {
    for (uint c = 0u; c < 3u; ++c) {
      uint k = 3u * entry.x + c;
      sum[c] = emitted_exitance[k] + reflectance[k] * direct_irradiance[k];
      initial_exitance[k] = sum[c];
    }
  }
  light[position] = vec4(uintBitsToFloat(entry.y) * sum, 0.0);
}
