#version 430
// Products with coupling matrices: one thread for each coefficient of the arriving light.
layout(local_size_x = 64) in;

layout(std140, binding = 8) uniform Stage {
  uvec4 range;           // items, first item, first output
  uvec4 channel_matrix;  // which matrix each channel uses; whether couplings are floats
};
layout(std430, binding = 0) readonly buffer Couplings { uint couplings[]; };  // floats, or pairs of halves
layout(std430, binding = 1) readonly buffer Scales { float scales[]; };
// Two entries for each side of a matrix: first input, inputs, first value, values of one matrix;
// values from output to output, values from input to input, bits of the matrix's scale.
layout(std430, binding = 2) readonly buffer Sides { uvec4 sides[]; };
layout(std430, binding = 3) readonly buffer Outputs { uvec2 outputs[]; };  // side, and place in it
layout(std430, binding = 4) readonly buffer Inputs { uint inputs[]; };     // slots
layout(std430, binding = 5) readonly buffer Light { vec4 light[]; };
layout(std430, binding = 6) writeonly buffer Arriving { vec4 arriving[]; };

float coupling(uint index) {
  if (channel_matrix.w != 0u) return uintBitsToFloat(couplings[index]);
  return unpackHalf2x16(couplings[index >> 1])[index & 1u];
}

void main() {
  uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (index >= range.x) return;
  uvec2 place = outputs[index];
  uvec4 side = sides[2u * place.x], strides = sides[2u * place.x + 1u];
  uvec3 value = side.z + channel_matrix.xyz * side.w + place.y * strides.x;
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < side.y; ++k) {
    vec3 factors = vec3(coupling(value.x), coupling(value.y), coupling(value.z));
    sum += factors * light[inputs[side.x + k]].xyz;
    value += strides.y;
  }
  uint slot = range.z + index;
  arriving[slot] = vec4(scales[slot] * uintBitsToFloat(strides.z) * sum, 0.0);
}
