// Fall-off, range window and cone of KHR_lights_punctual (Khronos glTF 2.0 extension, sections
// "Range Property", "Inner and Outer Cone Angles"), and lamps with a surface.

#include "prepared_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "disc_form_factor.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/polygon_form_factor.h"
#include "rebounce/runtime/sampling.h"
#include "sphere_form_factor.h"

namespace rebounce {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// An axis of the world that does not lie along the unit vector.
glm::vec3 least_axis(const glm::vec3& v) {
  return std::abs(v.x) < 0.5F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
}

// From the unit square to the unit disc (Shirley and Chiu 1997).
glm::vec2 disc_place(const glm::vec2& place) {
  const glm::dvec3 lifted = square_to_cosine_hemisphere(place);
  return {lifted.x, lifted.y};
}

}  // namespace

Sides sides_around(const glm::vec3& axis, const glm::vec3& tangent) {
  const glm::vec3 side = glm::normalize(tangent - glm::dot(tangent, axis) * axis);
  return {side, glm::cross(side, axis)};
}

PreparedLight::PreparedLight(const Light& light)
    : type_(light.type), reach_squared_(std::numeric_limits<float>::infinity()) {
  if (type_ != LightType::kDirectional) {
    position_ = to_glm(light.position);
    range_ = light.range;
    if (range_ > 0) reach_squared_ = range_ * range_;
  }
  if (type_ == LightType::kSphere || type_ == LightType::kDisc) radius_ = light.radius;
  if (type_ == LightType::kSphere) return;
  if (type_ != LightType::kPoint || light.profile) direction_ = to_glm(light.direction);
  if (type_ == LightType::kSpot) {
    cone_cosine_ = std::cos(light.outer_cone_angle);
    cone_scale_ = 1 / std::max(0.001F, std::cos(light.inner_cone_angle) - cone_cosine_);
  }
  if (type_ == LightType::kDisc) {
    const auto [side, other_side] = sides_around(direction_, least_axis(direction_));
    side_ = radius_ * side;
    other_side_ = radius_ * other_side;
    area_ = kPi * radius_ * radius_;
    return;
  }
  const bool rectangle = type_ == LightType::kRectangle;
  if (!rectangle && type_ != LightType::kDirectional) profile_ = light.profile;
  if (!rectangle && !profile_) return;
  const auto [side, other_side] = sides_around(direction_, to_glm(light.tangent));
  side_ = side * (rectangle ? 0.5F * light.size[0] : 1.0F);
  other_side_ = other_side * (rectangle ? 0.5F * light.size[1] : 1.0F);
  area_ = light.size[0] * light.size[1];
}

UnitLight PreparedLight::evaluate(const glm::vec3& point) const {
  if (type_ == LightType::kDirectional) {
    return {-direction_, std::numeric_limits<float>::infinity(), 1};
  }
  return from_lamp(position_ - point);
}

void PreparedLight::evaluate_places(const glm::vec3& point, std::span<const glm::vec2> places,
                                    std::span<UnitLight> light) const {
  if (type_ == LightType::kSphere) {
    from_sphere(position_ - point, places, light);
  } else {
    from_flat(position_ - point, places, light);
  }
}

UnitLight PreparedLight::from_lamp(const glm::vec3& to_lamp) const {
  const float distance_squared = glm::dot(to_lamp, to_lamp);
  // A point inside the lamp has no direction to it: it receives nothing.
  if (!(distance_squared > 0)) return {};
  const float distance = std::sqrt(distance_squared);
  const glm::vec3 direction = to_lamp / distance;
  float illuminance = range_window(distance_squared) / distance_squared;
  if (type_ == LightType::kSpot) illuminance *= cone_attenuation(-glm::dot(direction, direction_));
  if (profile_ && illuminance > 0) illuminance *= profile_candela(-direction);
  return {direction, distance, illuminance};
}

// Uniformly in the cone in which the sphere is seen.
void PreparedLight::from_sphere(const glm::vec3& to_center, std::span<const glm::vec2> places,
                                std::span<UnitLight> light) const {
  const float distance_squared = glm::dot(to_center, to_center);
  const float sine_squared = radius_ * radius_ / distance_squared;
  if (!(sine_squared < 1)) {  // inside
    std::ranges::fill(light, UnitLight{});
    return;
  }
  const float distance = std::sqrt(distance_squared);
  // 1 - cos of the cone's half angle, without cancellation.
  const float height = sine_squared / (1 + std::sqrt(1 - sine_squared));
  const float illuminance = 2 * kPi * height * range_window(distance_squared);
  const glm::vec3 axis = to_center / distance;
  const auto [x, y] = sides_around(axis, least_axis(axis));
  for (std::size_t k = 0; k < places.size(); ++k) {
    const float down = places[k].x * height;  // 1 - cosine of the direction to the axis
    const float cosine = 1 - down, sine_squared_here = down * (1 + cosine);
    const float sine = std::sqrt(sine_squared_here), turn = 2 * kPi * places[k].y;
    // Where it meets the sphere first.
    const float off_axis_squared = distance_squared * sine_squared_here;
    const float into = std::sqrt(std::max(0.0F, radius_ * radius_ - off_axis_squared));
    light[k] = {cosine * axis + sine * (std::cos(turn) * x + std::sin(turn) * y),
                distance * cosine - into, illuminance};
  }
}

// Uniformly over the area.
void PreparedLight::from_flat(const glm::vec3& to_center, std::span<const glm::vec2> places,
                              std::span<UnitLight> light) const {
  const float full = area_ * range_window(glm::dot(to_center, to_center));
  for (std::size_t k = 0; k < places.size(); ++k) {
    const glm::vec2 at =
        type_ == LightType::kDisc ? disc_place(places[k]) : 2.0F * places[k] - glm::vec2(1);
    const glm::vec3 path = to_center + at.x * side_ + at.y * other_side_;
    const float distance_squared = glm::dot(path, path);
    light[k] = {};
    if (!(distance_squared > 0)) continue;
    const float distance = std::sqrt(distance_squared);
    const glm::vec3 direction = path / distance;
    const float cosine = std::max(0.0F, -glm::dot(direction, direction_));
    light[k] = {direction, distance, full * cosine / distance_squared};
  }
}

float PreparedLight::unoccluded_irradiance(const glm::vec3& point, const glm::vec3& normal) const {
  const glm::vec3 to_center = position_ - point;
  const float window = range_window(glm::dot(to_center, to_center));
  if (window <= 0) return 0;
  if (type_ == LightType::kSphere) {
    return window * kPi * point_to_sphere_form_factor(to_center, normal, radius_);
  }
  if (glm::dot(to_center, direction_) >= 0) return 0;  // behind it
  if (type_ == LightType::kDisc) {
    return window * kPi * point_to_disc_form_factor(to_center, normal, direction_, radius_);
  }
  const std::array<glm::vec3, 4> corner = {
      position_ - side_ - other_side_, position_ + side_ - other_side_,
      position_ + side_ + other_side_, position_ - side_ + other_side_};
  return window * kPi * point_to_polygon_form_factor(point, normal, corner);
}

glm::vec3 PreparedLight::highest_point(const glm::vec3& normal) const {
  if (type_ == LightType::kSphere) return position_ + radius_ * normal;
  if (type_ == LightType::kDisc) {
    const glm::vec3 up = normal - glm::dot(normal, direction_) * direction_;
    const float length = glm::length(up);
    return length > 0 ? position_ + radius_ / length * up : position_;
  }
  const float up = std::copysign(1.0F, glm::dot(side_, normal));
  const float other_up = std::copysign(1.0F, glm::dot(other_side_, normal));
  return position_ + up * side_ + other_up * other_side_;
}

float PreparedLight::range_window(float distance_squared) const {
  if (range_ <= 0) return 1;
  const float ratio_squared = distance_squared / reach_squared_;
  return std::clamp(1 - ratio_squared * ratio_squared, 0.0F, 1.0F);
}

// `cosine`: between the cone's axis and the way from the lamp to the point.
float PreparedLight::cone_attenuation(float cosine) const {
  const float linear = std::clamp((cosine - cone_cosine_) * cone_scale_, 0.0F, 1.0F);
  return linear * linear;
}

float PreparedLight::profile_candela(const glm::vec3& from_lamp) const {
  const float vertical = std::acos(std::clamp(glm::dot(from_lamp, direction_), -1.0F, 1.0F));
  const float horizontal = std::atan2(glm::dot(from_lamp, other_side_), glm::dot(from_lamp, side_));
  return profile_->intensity(vertical, horizontal);
}

}  // namespace rebounce
