// A one-sided rectangle of uniform luminance, sampled by area.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "rebounce.h"
#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/polygon_form_factor.h"

namespace rebounce::rectangle_lamp {
namespace {

static_assert(static_cast<int>(LightType::kRectangle) == REBOUNCE_LIGHT_RECTANGLE);

constexpr const LampField* kFields[] = {&kPosition, &kDirection, &kColor,  &kIntensity,
                                        &kRange,    &kSize,      &kTangent};

// In order, in units of the sides.
constexpr std::array kCorners = {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1),
                                 glm::vec2(-1, 1)};

void prepare(const Light& light, PreparedLight& lamp) {
  lamp.direction = to_glm(light.direction);
  const auto [side, other_side] = sides_around(lamp.direction, to_glm(light.tangent));
  lamp.side = side * (0.5F * light.size[0]);
  lamp.other_side = other_side * (0.5F * light.size[1]);
  lamp.area = light.size[0] * light.size[1];
}

void evaluate_places(const PreparedLight& lamp, const glm::vec3& point,
                     std::span<const glm::vec2> places, std::span<UnitLight> light) {
  const glm::vec3 to_center = lamp.position - point;
  const float area = lamp.area * lamp.range_window(glm::dot(to_center, to_center));
  for (std::size_t k = 0; k < places.size(); ++k) {
    light[k] = from_flat_place(lamp, to_center, area, 2.0F * places[k] - glm::vec2(1));
  }
}

void places_of_part(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    const PartValues& u, const PartValues& v, PlacesOfPart& places) {
  PartValues x, y;
  for (std::size_t e = 0; e < x.size(); ++e) {
    x[e] = 2 * u[e] - 1;
    y[e] = 2 * v[e] - 1;
  }
  flat_places(lamp, points, part, x, y, places);
}

glm::vec3 corner(const PreparedLight& lamp, std::size_t k) {
  return lamp.position + kCorners[k].x * lamp.side + kCorners[k].y * lamp.other_side;
}

float form_factor(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal) {
  if (glm::dot(lamp.position - point, lamp.direction) >= 0) return 0;  // behind the rectangle
  std::array<glm::vec3, kCorners.size()> corners;
  for (std::size_t k = 0; k < corners.size(); ++k) corners[k] = corner(lamp, k);
  return point_to_polygon_form_factor(point, normal, corners);
}

// Lambert's formula where the horizon cuts nothing and no edge subtends more than a right angle.
void form_factors(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                  PartValues& factor) {
  struct Corner {
    PartValues x, y, z, length;  // from the point
  };
  std::array<Corner, kCorners.size()> corners;
  PartValues lowest, highest, least_cosine, sum{};
  lowest.fill(std::numeric_limits<float>::infinity());
  highest.fill(-lowest[0]);
  least_cosine.fill(1);
  const std::size_t begin = part * UnitLightBlock::kPart;
  const float *point_x = &points.position[0][begin], *point_y = &points.position[1][begin],
              *point_z = &points.position[2][begin];
  const float *normal_x = &points.normal[0][begin], *normal_y = &points.normal[1][begin],
              *normal_z = &points.normal[2][begin];
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const glm::vec3 at = corner(lamp, c);
    PartValues &x = corners[c].x, &y = corners[c].y, &z = corners[c].z;
    PartValues& length = corners[c].length;
#pragma omp simd
    for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
      x[e] = at.x - point_x[e];
      y[e] = at.y - point_y[e];
      z[e] = at.z - point_z[e];
      const float height = x[e] * normal_x[e] + y[e] * normal_y[e] + z[e] * normal_z[e];
      lowest[e] = std::min(lowest[e], height);
      highest[e] = std::max(highest[e], height);
      length[e] = std::sqrt(x[e] * x[e] + y[e] * y[e] + z[e] * z[e]);
    }
  }
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const Corner &a = corners[c], &b = corners[(c + 1) % corners.size()];
#pragma omp simd
    for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
      const float product = a.length[e] * b.length[e];
      const float cosine = (a.x[e] * b.x[e] + a.y[e] * b.y[e] + a.z[e] * b.z[e]) / product;
      const float axis_height = (a.y[e] * b.z[e] - a.z[e] * b.y[e]) * normal_x[e] +
                                (a.z[e] * b.x[e] - a.x[e] * b.z[e]) * normal_y[e] +
                                (a.x[e] * b.y[e] - a.y[e] * b.x[e]) * normal_z[e];
      sum[e] += acute_edge_term(cosine, axis_height, product);
      least_cosine[e] = std::min(cosine, least_cosine[e]);
    }
  }
  const glm::vec3 middle = lamp.position, direction = lamp.direction;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
    const float ahead = (middle.x - point_x[e]) * direction.x +
                        (middle.y - point_y[e]) * direction.y +
                        (middle.z - point_z[e]) * direction.z;
    const float whole = std::min(1.0F, std::abs(sum[e]) / (2 * std::numbers::pi_v<float>));
    const bool is_whole = (lowest[e] >= 0) & (least_cosine[e] >= 0);
    const bool is_dark = (ahead >= 0) | (highest[e] <= 0);
    const float other = is_dark ? 0.0F : -1.0F;
    factor[e] = is_whole & !is_dark ? whole : other;
  }
}

glm::vec3 highest_point(const PreparedLight& lamp, const glm::vec3& normal) {
  const float up = std::copysign(1.0F, glm::dot(lamp.side, normal));
  const float other_up = std::copysign(1.0F, glm::dot(lamp.other_side, normal));
  return lamp.position + up * lamp.side + other_up * lamp.other_side;
}

// The Hammersley set (J. M. Hammersley, 1960): of a power of two of places each half, quarter and
// so on of either side has its share, so that their middle is that of the lamp.
glm::vec3 place(const PreparedLight& lamp, std::uint32_t k, std::uint32_t count) {
  const float half = 0.5F / static_cast<float>(count);
  glm::vec2 at(static_cast<float>(k) / static_cast<float>(count), 0);
  float digit = 0.5F;
  for (std::uint32_t rest = k; rest > 0; rest /= 2, digit /= 2) {
    if (rest % 2 == 1) at.y += digit;
  }
  return from_middle(lamp, 2.0F * (at + half) - 1.0F);
}

LampMesh mesh(const PreparedLight& lamp) {
  return flat_mesh(lamp, kCorners);
}

float candela(const PreparedLight& lamp) {
  return lamp.area;
}

constexpr const char* kGlsl = R"(
float rectangle_irradiance(vec3 to_center, vec3 direction, vec3 normal) {
  return flat_irradiance(to_center, normal, 4);
}

vec3 rectangle_normal(vec3 place) { return lamp_direction; }
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
constinit const LampKind kKind{.type = LightType::kRectangle,
                               .name = "rectangle",
                               .plural = "rectangles",
                               .unit = "cd/m2",
                               .fields = kFields,
                               .shadow_map = ShadowMapKind::kPlaces,
                               .prepare = prepare,
                               .evaluate = nullptr,
                               .evaluate_block = nullptr,
                               .surface = &kSurface,
                               .glsl = kGlsl,
                               .shared_glsl = kFlatGlsl};

}  // namespace rebounce::rectangle_lamp
