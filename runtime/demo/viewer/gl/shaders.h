#pragma once

// The viewer's shaders, GLSL 3.30. Light is linear Rec.709, scaled by the exposure.

namespace rebounce::shaders {

/// All passes over the scene compute exactly the same positions, so that later passes can test
/// depths for equality.
inline constexpr const char* kSceneVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 vertex_color;
layout(location = 3) in vec2 base_color_texcoord;
layout(location = 4) in vec2 emissive_texcoord;
layout(location = 5) in vec3 first_flight;  // sky and emitters, lx
layout(location = 6) in vec3 bounced;       // lx
uniform mat4 clip_from_world;
out vec3 world_position, shading_normal, color, first_light, bounced_light;
centroid out vec3 covered_position;
out vec2 base_uv, emissive_uv;
invariant gl_Position;
void main() {
  world_position = covered_position = position;
  shading_normal = normal;
  color = vertex_color;
  base_uv = base_color_texcoord;
  emissive_uv = emissive_texcoord;
  first_light = first_flight;
  bounced_light = bounced;
  gl_Position = clip_from_world * vec4(position, 1);
}
)";

/// Light that needs no shadow map: from the vertices, and emission.
inline constexpr const char* kAmbientFragment = R"(#version 330 core
in vec3 color, first_light, bounced_light;
in vec2 base_uv, emissive_uv;
uniform sampler2D base_color_texture, emissive_texture;
uniform vec3 base_color, emitted_luminance;
uniform float base_alpha, alpha_cutoff;
uniform float first_part, bounced_part, exposure_scale;
out vec4 result;
void main() {
  vec4 base = texture(base_color_texture, base_uv);
  if (base_alpha * base.a < alpha_cutoff) discard;
  vec3 albedo = base_color * color * base.rgb;
  vec3 irradiance = first_part * first_light + bounced_part * bounced_light;
  vec3 emitted = first_part * emitted_luminance * texture(emissive_texture, emissive_uv).rgb *
                 exposure_scale;
  // Lamps no brighter than twice white, so that their edges are smooth.
  float peak = max(max(emitted.r, emitted.g), emitted.b);
  if (peak > 2) emitted *= 2 / peak;
  result = vec4(albedo * max(irradiance, 0) * (exposure_scale / 3.14159265) + emitted, 1);
}
)";

/// A colour for each patch, from a table.
inline constexpr const char* kPatchFragment = R"(#version 330 core
in vec3 world_position;
uniform usamplerBuffer patch_of_triangle;
uniform samplerBuffer color_of_patch;
uniform int first_triangle;
uniform vec3 eye, shading_direction;
uniform float shading;  // 0: the colour alone
out vec4 result;
void main() {
  uint patch_index = texelFetch(patch_of_triangle, first_triangle + gl_PrimitiveID).r;
  vec3 color = vec3(0.02);
  if (patch_index != 0xFFFFFFFFu) color = texelFetch(color_of_patch, int(patch_index)).rgb;
  vec3 geometric_normal = normalize(cross(dFdx(world_position), dFdy(world_position)));
  if (dot(geometric_normal, eye - world_position) < 0) geometric_normal = -geometric_normal;
  float facing = 0.75 + 0.25 * dot(geometric_normal, shading_direction);
  result = vec4(color * mix(1, facing, shading), 1);
}
)";

/// Draws a surface, or another `behind_texels` behind it.
inline constexpr const char* kShadowVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 3) in vec2 base_color_texcoord;
uniform mat4 clip_from_world;
uniform float behind_texels;
uniform float texel;   // metres; of a cube at unit distance
uniform int from_eye;  // a cube's map, and not a plane's
uniform vec3 eye;
out vec2 base_uv;
void main() {
  base_uv = base_color_texcoord;
  vec3 way = abs(position - eye);
  float size = texel * (from_eye == 1 ? max(max(way.x, way.y), way.z) : 1.0);
  gl_Position = clip_from_world * vec4(position - behind_texels * size * normal, 1);
}
)";

inline constexpr const char* kShadowFragment = R"(#version 330 core
in vec2 base_uv;
uniform sampler2D base_color_texture;
uniform float base_alpha, alpha_cutoff;
void main() {
  if (base_alpha * texture(base_color_texture, base_uv).a < alpha_cutoff) discard;
}
)";

/// One triangle that covers the screen.
inline constexpr const char* kScreenVertex = R"(#version 330 core
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1);
  gl_Position = vec4(corner, 0, 1);
}
)";

/// Tone curve (tone_curve.h), dither (image_file.cpp) and sRGB encoding.
inline constexpr const char* kScreenFragment = R"(#version 330 core
uniform sampler2D light;
uniform int display_referred, height;
out vec4 result;

vec3 tone_curve(vec3 color) {
  const float kShoulder = 0.7, kDesaturation = 0.15, kRoom = 0.3;
  float peak = max(max(color.r, color.g), color.b);
  if (peak <= kShoulder) return color;
  float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kShoulder);
  float white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  return mix(color * (new_peak / peak), vec3(new_peak), white);
}

void main() {
  // Sums past the largest 16-bit float are infinite.
  vec3 color = min(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb, vec3(65504));
  if (display_referred == 0) color = tone_curve(color);
  color = clamp(color, 0, 1);
  vec3 encoded = mix(12.92 * color, 1.055 * pow(max(color, 1e-6), vec3(1 / 2.4)) - 0.055,
                     greaterThan(color, vec3(0.0031308)));
  if (display_referred == 0) {
    vec2 pixel = vec2(floor(gl_FragCoord.x), float(height) - 1 - floor(gl_FragCoord.y));
    float noise = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
    encoded += (noise - 0.5) / 255;
  }
  result = vec4(encoded, 1);
}
)";

}  // namespace rebounce::shaders
