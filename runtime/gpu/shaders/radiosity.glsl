#version 430
// The indirect irradiance H from positions to patches, and B = M0 + rho H.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses
};
layout(std430, binding = 0) writeonly buffer IndirectIrradiance { float indirect_irradiance[]; };
layout(std430, binding = 1) readonly buffer Reflectance { float reflectance[]; };
layout(std430, binding = 2) writeonly buffer Radiosity { float radiosity[]; };
// The patch at each position, or 0xFFFFFFFF.
layout(std430, binding = 3) readonly buffer Positions { uvec2 positions[]; };
layout(std430, binding = 4) readonly buffer InitialExitance { float initial_exitance[]; };
layout(std430, binding = 6) readonly buffer Arriving { vec4 arriving[]; };

void main() {
  uint position = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (position >= range.x) return;
  uint patch_index = positions[position].x;
  if (patch_index == 0xFFFFFFFFu) return;
  vec3 irradiance = arriving[position].xyz;
  for (uint c = 0u; c < 3u; ++c) {
    uint k = 3u * patch_index + c;
    indirect_irradiance[k] = irradiance[c];
    radiosity[k] = initial_exitance[k] + reflectance[k] * irradiance[c];
  }
}
