#pragma once

namespace rebounce::shaders {

/// One lamp, added to what is there. Fall-off, range and cone as in light_sampling.cpp.
///
/// What arrives from a lamp with a surface is its closed form (sphere_form_factor.cpp,
/// polygon_form_factor.cpp; discs are polygons of many corners) times the part that is not hidden,
/// as seen by shadow maps from places all over the lamp (body_mesh.h), each weighted by what it
/// contributes (E. Heitz, S. Hill, M. McGuire, "Combining analytic direct illumination and
/// stochastic shadows", I3D 2018). Each place stands for a part of the lamp, whose own small half
/// shadow is that of R. Fernando, "Percentage-closer soft shadows", SIGGRAPH 2005.
inline constexpr const char* kLampFragment = R"(#version 330 core
in vec3 world_position, shading_normal, color;
in vec2 base_uv;
uniform sampler2D base_color_texture;
uniform vec3 base_color, eye;
uniform float base_alpha, alpha_cutoff;
uniform float exposure_scale;
uniform int lamp_type;  // 0 point, 1 spot, 2 directional, 3 sphere, 4 flat
uniform vec3 lamp_position, lamp_direction, lamp_color;
uniform float lamp_range, cos_inner, cos_outer;
uniform float lamp_radius;                // sphere, metres
uniform vec3 lamp_side, lamp_other_side;  // flat: from the middle to the rim
uniform int lamp_corners;                 // flat: 4, or many for a disc
const int kPlaces = 16;
uniform vec3 lamp_places[kPlaces];        // on its surface, from the middle
uniform float place_reach;                // metres around a place that it stands for
uniform samplerCubeShadow cube_shadow;
uniform sampler2DArrayShadow place_shadow;  // six faces for each place
uniform sampler2DArray place_depth;
uniform sampler2DShadow plane_shadow;
uniform mat4 plane_from_world;
uniform vec2 near_far;
uniform float texel;  // of the cube at unit distance; of the plane in metres
uniform float smallest_offset;  // metres
out vec4 result;

const float kPi = 3.14159265;
const int kTaps = 16;
const float kRadius = 1.5;  // texels
const int kPlaceTaps = 8;
const float kWidest = 2.0;  // half shadow of a place, in what it stands for

// Evenly over a disc (H. Vogel, 1979).
vec2 tap(int k, int count) {
  float angle = 2.39996323 * float(k);
  return sqrt((float(k) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

float largest(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

// What the cube's depth is at `z` metres along an axis, and the other way round.
float depth_at(float z) {
  return 0.5 + 0.5 * (near_far.y + near_far.x - 2 * near_far.x * near_far.y / z) /
                   (near_far.y - near_far.x);
}
float metres_at(float depth) {
  return 2 * near_far.x * near_far.y /
         (near_far.y + near_far.x - (2 * depth - 1) * (near_far.y - near_far.x));
}

mat2x3 across(vec3 way) {
  vec3 side = normalize(cross(way, abs(way.y) < 0.9 * length(way) ? vec3(0, 1, 0) : vec3(1, 0, 0)));
  return mat2x3(side, normalize(cross(side, way)));
}

// From where a shadow map is to the receiver, off its surface by what a slanted texel and the taps
// around it reach.
vec3 lifted_way(vec3 way, vec3 geometric_normal) {
  return way + geometric_normal * (smallest_offset + (kRadius + 1) * texel * largest(way));
}

float cube_visibility(vec3 way) {
  mat2x3 axes = across(way);
  float spread = kRadius * texel * largest(way);
  float sum = 0;
  for (int k = 0; k < kTaps; ++k) {
    vec3 to = way + axes * (spread * tap(k, kTaps));
    sum += texture(cube_shadow, vec4(to, depth_at(largest(to))));
  }
  return sum / float(kTaps);
}

float plane_visibility(vec3 point, vec3 geometric_normal) {
  vec3 off = point + geometric_normal * (smallest_offset + (kRadius + 1) * texel);
  vec3 at = (plane_from_world * vec4(off, 1)).xyz * 0.5 + 0.5;
  vec2 spread = kRadius / vec2(textureSize(plane_shadow, 0));
  float sum = 0;
  for (int k = 0; k < kTaps; ++k) {
    sum += texture(plane_shadow, vec3(at.xy + spread * tap(k, kTaps), at.z));
  }
  return sum / float(kTaps);
}

// Where `to` meets the six faces of a place's map; the layers are in the order of a cube's.
vec3 face_coordinates(vec3 to, int place) {
  vec3 size = abs(to);
  int face;
  vec3 at;  // across, down, along
  if (size.x >= size.y && size.x >= size.z) {
    face = to.x > 0 ? 0 : 1;
    at = vec3(to.x > 0 ? -to.z : to.z, -to.y, size.x);
  } else if (size.y >= size.z) {
    face = to.y > 0 ? 2 : 3;
    at = vec3(to.x, to.y > 0 ? to.z : -to.z, size.y);
  } else {
    face = to.z > 0 ? 4 : 5;
    at = vec3(to.z > 0 ? to.x : -to.x, -to.y, size.z);
  }
  return vec3(0.5 + 0.5 * at.xy / at.z, float(6 * place + face));
}

// The way to where `to` meets the plane of the receiver, as a part of `to` and at most all of it. A
// plane that is seen at a slant is not followed far: past its edges something else may be lit.
float part_to_plane(vec3 to, vec3 way, vec3 geometric_normal) {
  float height = dot(geometric_normal, way), slope = dot(geometric_normal, to);
  return slope < 0 && height < 0 ? clamp(height / slope, 0.95, 1.0) : 1.0;
}

// How wide the half shadow of a place is at the receiver, metres.
float half_shadow(vec3 way, vec3 geometric_normal, mat2x3 axes, int place) {
  float sum = 0, found = 0;
  for (int k = 0; k < kPlaceTaps; ++k) {
    vec2 at = kWidest * tap(k, kPlaceTaps);
    vec3 to = way + axes * (place_reach * at);
    float part = metres_at(texture(place_depth, face_coordinates(to, place)).r) / largest(to);
    // Near enough to the lamp to be between it and the receiver, and not the receiver itself.
    if (part > part_to_plane(to, way, geometric_normal) - 2e-3) continue;
    if (length(at) > 1 / part - 1) continue;
    sum += part;
    found += 1;
  }
  return found > 0 ? place_reach * min(found / sum - 1, kWidest) : 0.0;
}

float place_visibility(vec3 way, vec3 geometric_normal, int place) {
  mat2x3 axes = across(way);
  float spread = max(kRadius * texel * largest(way),
                     half_shadow(way, geometric_normal, axes, place));
  float sum = 0;
  for (int k = 0; k < kPlaceTaps; ++k) {
    vec3 to = way + axes * (spread * tap(k, kPlaceTaps));
    to *= part_to_plane(to, way, geometric_normal);
    sum += texture(place_shadow, vec4(face_coordinates(to, place), depth_at(largest(to))));
  }
  return sum / float(kPlaceTaps);
}

// The part of a lamp with a surface that is seen.
float surface_visibility(vec3 point, vec3 normal, vec3 geometric_normal) {
  float seen = 0, all = 0;
  for (int k = 0; k < kPlaces; ++k) {
    vec3 to_place = lamp_position + lamp_places[k] - point;
    vec3 lamp_normal = lamp_type == 3 ? lamp_places[k] / lamp_radius : lamp_direction;
    float cosines = max(0.0, dot(normal, to_place)) * max(0.0, -dot(lamp_normal, to_place));
    if (cosines <= 0) continue;
    float distance_squared = dot(to_place, to_place);
    float weight = cosines / (distance_squared * distance_squared);
    all += weight;
    if (dot(geometric_normal, to_place) <= 0) continue;
    seen += weight *
            place_visibility(lifted_way(-to_place, geometric_normal), geometric_normal, k);
  }
  return all > 0 ? seen / all : 0.0;
}

// Howell's catalogue, B-43, with arcs as tangents: OpenGL's arc sines are coarse.
float sphere_form_factor(vec3 to_center, vec3 normal) {
  float sine_squared = lamp_radius * lamp_radius / dot(to_center, to_center);
  float height = dot(to_center, normal);
  if (sine_squared >= 1) return 1.0;
  if (height <= -lamp_radius) return 0.0;
  float cosine = height / length(to_center);
  if (height >= lamp_radius) return sine_squared * cosine;
  float cotangent = sqrt(1 / sine_squared - 1);
  float rim = sqrt(max(0.0, 1 - cosine * cosine / sine_squared));
  float turn = atan(rim, -cotangent * cosine);
  float lens = atan(sqrt(sine_squared) * rim, sqrt(1 - sine_squared));
  return max(0.0, (sine_squared * (cosine * turn - cotangent * rim) + lens) / kPi);
}

float edge_integral(vec3 a, vec3 b, vec3 normal) {
  vec3 axis = cross(a, b);
  float sine = length(axis);
  return sine > 0 ? atan(sine, dot(a, b)) * dot(axis, normal) / sine : 0.0;
}

// Corner k, seen from the receiver. That of a disc are outside of it by what makes the areas equal.
vec3 lamp_corner(int k, vec3 to_center) {
  float step = 2 * kPi / float(lamp_corners), angle = (float(k) + 0.5) * step;
  float reach = lamp_corners == 4 ? sqrt(2.0) : sqrt(step / sin(step));
  return to_center + reach * (cos(angle) * lamp_side + sin(angle) * lamp_other_side);
}

// Lambert's formula, cut at the horizon.
float flat_form_factor(vec3 to_center, vec3 normal) {
  if (dot(to_center, lamp_direction) >= 0) return 0.0;  // from behind
  float sum = 0;
  bool cut = false;
  vec3 rises = vec3(0), sets = vec3(0);
  vec3 a = lamp_corner(lamp_corners - 1, to_center);
  for (int k = 0; k < lamp_corners; ++k) {
    vec3 b = lamp_corner(k, to_center);
    float height_a = dot(a, normal), height_b = dot(b, normal);
    vec3 horizon = mix(a, b, height_a / (height_a - height_b));
    if (height_a >= 0 && height_b >= 0) sum += edge_integral(a, b, normal);
    if (height_a < 0 && height_b >= 0) {
      rises = horizon;
      sum += edge_integral(rises, b, normal);
    }
    if (height_a >= 0 && height_b < 0) {
      sets = horizon;
      sum += edge_integral(a, sets, normal);
      cut = true;
    }
    a = b;
  }
  if (cut) sum += edge_integral(sets, rises, normal);
  return clamp(abs(sum) / (2 * kPi), 0.0, 1.0);
}

// Irradiance for luminance or intensity 1, where nothing is in between.
float unshadowed(vec3 to_lamp, vec3 direction, vec3 normal, vec3 geometric_normal) {
  if (lamp_type == 3) return kPi * sphere_form_factor(to_lamp, normal);
  if (lamp_type == 4) return kPi * flat_form_factor(to_lamp, normal);
  if (dot(geometric_normal, direction) <= 0) return 0.0;
  float strength = max(0.0, dot(normal, direction));
  if (lamp_type != 2) strength /= max(dot(to_lamp, to_lamp), 1e-12);
  if (lamp_type == 1) {
    float inside = (dot(-direction, lamp_direction) - cos_outer) / max(0.001, cos_inner - cos_outer);
    inside = clamp(inside, 0.0, 1.0);
    strength *= inside * inside;
  }
  return strength;
}

float range_window(float distance_squared) {
  if (lamp_type == 2 || lamp_range <= 0) return 1.0;
  float ratio = distance_squared / (lamp_range * lamp_range);
  return clamp(1.0 - ratio * ratio, 0.0, 1.0);
}

void main() {
  vec4 base = texture(base_color_texture, base_uv);
  vec3 to_lamp = lamp_type == 2 ? -lamp_direction : lamp_position - world_position;
  vec3 direction = to_lamp * inversesqrt(max(dot(to_lamp, to_lamp), 1e-12));
  vec3 geometric_normal = normalize(cross(dFdx(world_position), dFdy(world_position)));
  if (dot(geometric_normal, eye - world_position) < 0) geometric_normal = -geometric_normal;
  vec3 normal = normalize(shading_normal);
  float strength = unshadowed(to_lamp, direction, normal, geometric_normal) *
                   range_window(dot(to_lamp, to_lamp));
  if (strength <= 0 || base_alpha * base.a < alpha_cutoff) discard;
  if (lamp_type == 2) {
    strength *= plane_visibility(world_position, geometric_normal);
  } else if (lamp_type > 2) {
    strength *= surface_visibility(world_position, normal, geometric_normal);
  } else {
    strength *= cube_visibility(lifted_way(-to_lamp, geometric_normal));
  }
  vec3 albedo = base_color * color * base.rgb;
  result = vec4(albedo * lamp_color * (strength * exposure_scale / kPi), 0);
}
)";

}  // namespace rebounce::shaders
