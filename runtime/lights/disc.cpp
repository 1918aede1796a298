// A one-sided disc of uniform luminance, sampled by area. The form factor is an integral around the
// rim by Stokes' theorem (E. Sparrow, "A new and simpler formulation for radiative angle factors",
// 1963). It is elementary for an arc of a circle. The chord where a horizon cuts the disc adds
// Lambert's term for an edge.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::disc_lamp {
namespace {

static_assert(static_cast<int>(LightType::kDisc) == REBOUNCE_LIGHT_DISC);

constexpr const LampField* kFields[] = {&kPosition,  &kDirection, &kColor,
                                        &kIntensity, &kRange,     &kRadius};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.direction = to_glm(light.direction);
  lamp.radius = light.radius;
  const auto [side, other_side] = sides_around(lamp.direction, least_axis(lamp.direction));
  lamp.side = lamp.radius * side;
  lamp.other_side = lamp.radius * other_side;
  lamp.area = std::numbers::pi_v<float> * lamp.radius * lamp.radius;
}

void evaluate_places(const PreparedLight& lamp, const glm::vec3& point,
                     std::span<const glm::vec2> places, std::span<UnitLight> light) {
  const glm::vec3 to_center = lamp.position - point;
  const float area = lamp.area * lamp.range_window(glm::dot(to_center, to_center));
  for (std::size_t k = 0; k < places.size(); ++k) {
    glm::vec2 at;
    square_to_disc(places[k].x, places[k].y, at.x, at.y);
    light[k] = from_flat_place(lamp, to_center, area, at);
  }
}

void places_of_part(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    const PartValues& u, const PartValues& v, PlacesOfPart& places) {
  PartValues x, y;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) square_to_disc(u[e], v[e], x[e], y[e]);
  flat_places(lamp, points, part, x, y, places);
}

/// The form factor of a disc that is wholly above the horizon: around a whole rim the integral is
/// 2 pi (a / s - b e / (s (s + d))), with s² = d² - e² and the names of Rim, here without small
/// differences of large numbers. `squared`: square of the distance to the centre; `along`: the
/// centre's place along the disc's axis; `height`: over the horizon; `cosine`: of the angle between
/// axis and normal.
inline float whole_disc(float radius, float squared, float along, float height, float cosine) {
  const float r = radius * radius, z = along * along, off = std::max(0.0F, squared - z);
  const float difference = off - r;
  const float s = std::sqrt(difference * difference + z * (z + 2 * (off + r)));
  const float turned = r * (1 + (r + 2 * z - 2 * off) / (s + squared));  // s + r - squared
  const float factor = r * std::abs(cosine * turned + 2 * along * height) / (s * (s + squared + r));
  return std::min(1.0F, std::max(0.0F, factor));
}

/// How far the rim reaches above and below the centre, seen against the horizon. A little more, so
/// that rounding cuts no disc off.
inline float disc_amplitude(float radius, float cosine) {
  constexpr float kMargin = 1.001F;
  return kMargin * radius * std::sqrt(std::max(0.0F, 1 - cosine * cosine)) + 1e-3F * radius;
}

constexpr double kPi = std::numbers::pi;

// Below this the distance to the rim is treated as constant. That formula is exact up to the square
// of the eccentricity; the other one divides by the eccentricity and loses accuracy.
constexpr double kSmallEccentricity = 1e-7;

/// The rim center + radius (cos(t) u + sin(t) v), seen from the origin.
class Rim {
 public:
  Rim(const glm::dvec3& center, const glm::dvec3& normal, const glm::dvec3& axis, double radius)
      : center_(center), radius_(radius) {
    const glm::dvec3 off_axis = center - glm::dot(center, axis) * axis;
    const double distance = glm::length(off_axis);
    const glm::dvec3 least = std::abs(axis.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    u_ = distance > 0 ? off_axis / distance : glm::normalize(glm::cross(axis, least));
    v_ = glm::cross(axis, u_);
    // normal . (r x dr/dt) = a + b cos t + c sin t,  |r|² = d + e cos t
    a_ = radius * radius * glm::dot(normal, axis);
    b_ = radius * glm::dot(normal, glm::cross(center, v_));
    c_ = -radius * glm::dot(normal, glm::cross(center, u_));
    d_ = glm::dot(center, center) + radius * radius;
    e_ = 2 * radius * glm::dot(center, u_);
  }

  glm::dvec3 at(double t) const {
    return center_ + radius_ * (std::cos(t) * u_ + std::sin(t) * v_);
  }

  /// The height above a horizon through the origin is height(t) = h + amplitude cos(t - turn).
  double amplitude(const glm::dvec3& normal) const {
    return radius_ * std::hypot(glm::dot(normal, u_), glm::dot(normal, v_));
  }
  double turn(const glm::dvec3& normal) const {
    return std::atan2(glm::dot(normal, v_), glm::dot(normal, u_));
  }

  /// The integral of normal . (r x dr) / |r|² from `begin` to `end`, over at most a whole turn.
  double integral(double begin, double end) const {
    const double shift = 2 * kPi * std::floor((begin + kPi) / (2 * kPi));
    begin -= shift;
    end -= shift;
    if (end <= kPi) return primitive(end) - primitive(begin);
    return primitive(kPi) - primitive(begin) + primitive(end - 2 * kPi) - primitive(-kPi);
  }

 private:
  /// The antiderivative, for t in [-pi, pi].
  double primitive(double t) const {
    if (e_ < kSmallEccentricity * d_) return (a_ * t + b_ * std::sin(t) - c_ * std::cos(t)) / d_;
    const double angle =
        std::atan2(std::sqrt(d_ - e_) * std::sin(t / 2), std::sqrt(d_ + e_) * std::cos(t / 2));
    return b_ / e_ * t + (a_ - b_ * d_ / e_) * 2 * angle / std::sqrt(d_ * d_ - e_ * e_) -
           c_ / e_ * std::log(d_ + e_ * std::cos(t));
  }

  glm::dvec3 center_, u_, v_;
  double radius_, a_, b_, c_, d_, e_;
};

/// Lambert's term for the edge from `a` to `b`.
double edge_integral(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& normal) {
  const glm::dvec3 axis = glm::cross(a, b);
  const double sine = glm::length(axis);
  return sine > 0 ? std::atan2(sine, glm::dot(a, b)) * glm::dot(axis, normal) / sine : 0.0;
}

float cut_disc(const PreparedLight& lamp, const glm::vec3& to_center, const glm::vec3& normal) {
  const glm::dvec3 center(to_center), up(normal);
  const Rim rim(center, up, glm::dvec3(lamp.direction), lamp.radius);
  const double height = glm::dot(center, up), amplitude = rim.amplitude(up);
  if (height <= -amplitude) return 0;
  const double turn = rim.turn(up), half = std::acos(std::max(-1.0, -height / amplitude));
  const double sum = rim.integral(turn - half, turn + half) +
                     edge_integral(rim.at(turn + half), rim.at(turn - half), up);
  return static_cast<float>(std::clamp(std::abs(sum) / (2 * kPi), 0.0, 1.0));
}

float form_factor(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal) {
  const glm::vec3 to_center = lamp.position - point;
  const float along = glm::dot(to_center, lamp.direction);
  if (along >= 0) return 0;  // behind the disc, or in its plane
  const float height = glm::dot(to_center, normal), cosine = glm::dot(lamp.direction, normal);
  const float amplitude = disc_amplitude(lamp.radius, cosine);
  return height >= amplitude
             ? whole_disc(lamp.radius, glm::dot(to_center, to_center), along, height, cosine)
             : cut_disc(lamp, to_center, normal);
}

void form_factors(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                  PartValues& factor) {
  const glm::vec3 middle = lamp.position, direction = lamp.direction;
  const float radius = lamp.radius;
  const std::size_t begin = part * UnitLightBlock::kPart;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
    const std::size_t k = begin + e;
    const PathFromPoint to_center(middle, points, k);
    const float along = to_center.along(direction), height = to_center.height(points, k);
    const float cosine = direction.x * points.normal[0][k] + direction.y * points.normal[1][k] +
                         direction.z * points.normal[2][k];
    const float amplitude = disc_amplitude(radius, cosine);
    const float whole = whole_disc(radius, to_center.squared(), along, height, cosine);
    const bool is_dark = (along >= 0) | (height <= -amplitude);
    const float other = is_dark ? 0.0F : -1.0F;
    factor[e] = (height >= amplitude) & !is_dark ? whole : other;
  }
}

glm::vec3 highest_point(const PreparedLight& lamp, const glm::vec3& normal) {
  const glm::vec3 up = normal - glm::dot(normal, lamp.direction) * lamp.direction;
  const float length = glm::length(up);
  return length > 0 ? lamp.position + lamp.radius / length * up : lamp.position;
}

glm::vec3 place(const PreparedLight& lamp, std::uint32_t k, std::uint32_t count) {
  const float part = (static_cast<float>(k) + 0.5F) / static_cast<float>(count);
  return from_middle(lamp, std::sqrt(part) * golden_turn(k));
}

LampMesh mesh(const PreparedLight& lamp) {
  std::array<glm::vec2, 96> rim;
  for (std::size_t k = 0; k < rim.size(); ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / rim.size();
    rim[k] = {std::cos(angle), std::sin(angle)};
  }
  return flat_mesh(lamp, rim);
}

float candela(const PreparedLight& lamp) {
  return lamp.area;
}

// In the shader the disc is a polygon with many corners.
constexpr const char* kGlsl = R"(
float disc_irradiance(vec3 to_center, vec3 direction, vec3 normal) {
  return flat_irradiance(to_center, normal, 24);
}

vec3 disc_normal(vec3 place) { return lamp_direction; }
)";

constexpr LampSurface kSurface{.evaluate_places = evaluate_places,
                               .places_of_part = places_of_part,
                               .form_factor = form_factor,
                               .form_factors = form_factors,
                               .highest_point = highest_point,
                               .place = place,
                               .mesh = mesh,
                               .candela = candela,
                               .punctual = LightType::kSpot};

}  // namespace

extern const LampKind kKind;
constinit const LampKind kKind{.type = LightType::kDisc,
                               .name = "disc",
                               .plural = "discs",
                               .unit = "cd/m2",
                               .fields = kFields,
                               .shadow_map = ShadowMapKind::kPlaces,
                               .prepare = prepare,
                               .evaluate = nullptr,
                               .evaluate_block = nullptr,
                               .surface = &kSurface,
                               .glsl = kGlsl,
                               .shared_glsl = kFlatGlsl};

}  // namespace rebounce::disc_lamp
