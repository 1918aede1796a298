#include "runtime/demo/viewer/gl/lamp_shader.h"

#include <set>
#include <string_view>

#include "runtime/lights/lamp_kind.h"

namespace rebounce::shaders {
namespace {

/// A lamp with a surface has the irradiance of its closed form times its visible fraction. Shadow
/// maps from points all over the lamp give this fraction, each point weighted by its contribution
/// (E. Heitz, S. Hill, M. McGuire, "Combining analytic direct illumination and stochastic shadows",
/// I3D 2018). Each point stands for a part of the lamp; the part's own small penumbra is computed
/// as in R. Fernando, "Percentage-closer soft shadows", SIGGRAPH 2005.
constexpr const char* kBegin = R"(#version 330 core
in vec3 world_position, shading_normal, color;
// On the triangle also where it covers a pixel in part, and not past the seam of two walls.
centroid in vec3 covered_position;
in vec2 base_uv;
uniform sampler2D base_color_texture;
uniform vec3 base_color, eye;
uniform float base_alpha, alpha_cutoff;
uniform float exposure_scale;
uniform int lamp_type;   // LightType
uniform int shadow_map;  // ShadowMapKind: 0 cube, 1 plane, 2 places
uniform vec3 lamp_position, lamp_direction, lamp_color;
uniform float lamp_range, cos_inner, cos_outer;
uniform float lamp_radius;  // metres
uniform vec3 lamp_side, lamp_other_side;
const int kPlaces = 16;
uniform vec3 lamp_places[kPlaces];  // on its surface, from the middle
uniform float place_reach;  // metres around a place that it stands for
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
const float kRadius = 1.0;  // texels
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
  return way + geometric_normal * (smallest_offset + (kRadius + 2) * texel * largest(way));
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
  vec3 off = point + geometric_normal * (smallest_offset + (kRadius + 2) * texel);
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

// How wide the half shadow of a place is at the receiver, metres. What lies behind the surface of
// the lamp there stops none of its light.
float half_shadow(vec3 way, vec3 geometric_normal, vec3 lamp_normal, mat2x3 axes, int place) {
  float sum = 0, found = 0;
  for (int k = 0; k < kPlaceTaps; ++k) {
    vec2 at = kWidest * tap(k, kPlaceTaps);
    vec3 to = way + axes * (place_reach * at);
    if (dot(lamp_normal, to) <= 0) continue;
    float part = metres_at(texture(place_depth, face_coordinates(to, place)).r) / largest(to);
    // Near enough to the lamp to be between it and the receiver, and not the receiver itself.
    if (part > part_to_plane(to, way, geometric_normal) - 2e-3) continue;
    if (length(at) > 1 / part - 1) continue;
    sum += part;
    found += 1;
  }
  return found > 0 ? place_reach * min(found / sum - 1, kWidest) : 0.0;
}

float place_visibility(vec3 way, vec3 geometric_normal, vec3 lamp_normal, int place) {
  mat2x3 axes = across(way);
  float spread = max(kRadius * texel * largest(way),
                     half_shadow(way, geometric_normal, lamp_normal, axes, place));
  float sum = 0, count = 0;
  for (int k = 0; k < kPlaceTaps; ++k) {
    vec3 to = way + axes * (spread * tap(k, kPlaceTaps));
    if (dot(lamp_normal, to) <= 0) continue;
    to *= part_to_plane(to, way, geometric_normal);
    sum += texture(place_shadow, vec4(face_coordinates(to, place), depth_at(largest(to))));
    count += 1;
  }
  return count > 0 ? sum / count : 1.0;
}
)";

constexpr const char* kEnd = R"(
// The part of a lamp with a surface that is seen.
float surface_visibility(vec3 point, vec3 normal, vec3 geometric_normal) {
  float seen = 0, all = 0;
  for (int k = 0; k < kPlaces; ++k) {
    vec3 to_place = lamp_position + lamp_places[k] - point;
    vec3 lamp_normal = surface_normal(lamp_places[k]);
    float cosines = max(0.0, dot(normal, to_place)) * max(0.0, -dot(lamp_normal, to_place));
    if (cosines <= 0) continue;
    float distance_squared = dot(to_place, to_place);
    float weight = cosines / (distance_squared * distance_squared);
    all += weight;
    if (dot(geometric_normal, to_place) <= 0) continue;
    seen += weight *
            place_visibility(lifted_way(-to_place, geometric_normal), geometric_normal, lamp_normal,
                             k);
  }
  return all > 0 ? seen / all : 0.0;
}

float range_window(float distance_squared) {
  if (shadow_map == 1 || lamp_range <= 0) return 1.0;
  float ratio = distance_squared / (lamp_range * lamp_range);
  return clamp(1.0 - ratio * ratio, 0.0, 1.0);
}

void main() {
  vec4 base = texture(base_color_texture, base_uv);
  vec3 geometric_normal = normalize(cross(dFdx(world_position), dFdy(world_position)));
  // A driver may find centroids so roughly that they leave the plane of their triangle (lab/131).
  vec3 place = covered_position -
               geometric_normal * dot(covered_position - world_position, geometric_normal);
  vec3 to_lamp = shadow_map == 1 ? -lamp_direction : lamp_position - place;
  vec3 direction = to_lamp * inversesqrt(max(dot(to_lamp, to_lamp), 1e-12));
  if (dot(geometric_normal, eye - world_position) < 0) geometric_normal = -geometric_normal;
  vec3 normal = normalize(shading_normal);
  bool from_below = shadow_map != 2 && dot(geometric_normal, direction) <= 0;
  float strength = from_below ? 0.0 : unshadowed(to_lamp, direction, normal);
  strength *= range_window(dot(to_lamp, to_lamp));
  if (strength <= 0 || base_alpha * base.a < alpha_cutoff) discard;
  if (shadow_map == 1) {
    strength *= plane_visibility(place, geometric_normal);
  } else if (shadow_map == 2) {
    strength *= surface_visibility(place, normal, geometric_normal);
  } else {
    strength *= cube_visibility(lifted_way(-to_lamp, geometric_normal));
  }
  vec3 albedo = base_color * color * base.rgb;
  result = vec4(albedo * lamp_color * (strength * exposure_scale / kPi), 0);
}
)";

/// A function that passes `arguments` on to the function of the lamp's kind whose name ends in
/// `suffix`.
std::string dispatcher(const std::string& declaration, const std::string& suffix,
                       const std::string& arguments, const std::string& otherwise,
                       bool surfaces_only) {
  std::string text = declaration + " {\n";
  for (const LampKind* kind : lamp_kinds()) {
    if (surfaces_only && kind->surface == nullptr) continue;
    text += "  if (lamp_type == " + std::to_string(static_cast<int>(kind->type)) + ") return " +
            std::string(kind->name) + suffix + "(" + arguments + ");\n";
  }
  return text + "  return " + otherwise + ";\n}\n";
}

}  // namespace

std::string lamp_fragment() {
  std::string source = kBegin;
  std::set<std::string_view> shared;
  for (const LampKind* kind : lamp_kinds()) {
    if (shared.insert(kind->shared_glsl).second) source += kind->shared_glsl;
    source += kind->glsl;
  }
  source += "\n// Irradiance at intensity 1, where nothing is in between, but for the range.\n";
  source += dispatcher("float unshadowed(vec3 to_lamp, vec3 direction, vec3 normal)", "_irradiance",
                       "to_lamp, direction, normal", "0.0", false);
  source += dispatcher("vec3 surface_normal(vec3 place)", "_normal", "place", "place", true);
  return source + kEnd;
}

}  // namespace rebounce::shaders
