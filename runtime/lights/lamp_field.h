#pragma once

// The fields of Light: for each, its names in LIGHTS.json and the values that it may have. Each
// kind of lamp (lamp_kind.h) lists the fields that it uses; a field of one kind only may be in the
// file of that kind.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "rebounce/lights.h"

namespace rebounce {

enum class FieldRule : std::uint8_t {
  kFinite,       ///< any finite numbers
  kNotNegative,  ///< each at least 0
  kLength,       ///< metres, each above 0; has no default
  kUnitVector,
  kAcross,   ///< a vector that is not parallel to the light's direction
  kCone,     ///< inner and outer angle, radians: 0 <= inner <= outer <= pi / 2
  kProfile,  ///< an IntensityProfile, or none
};

struct LampField {
  std::string_view name;   ///< in messages
  const char* label = "";  ///< of its control in the viewer; for lengths and directions
  /// Keys in LIGHTS.json: one for all of its values, or one for each.
  std::array<std::string_view, 2> json;
  FieldRule rule;
  std::span<float> (*values)(Light& light);
  /// Whether LIGHTS.json may give it to kinds that do not use it.
  bool is_common = false;

  std::size_t json_count() const { return json[1].empty() ? 1 : 2; }
};

inline constexpr LampField kPosition{
    .name = "position",
    .json = {"position"},
    .rule = FieldRule::kFinite,
    .values = [](Light& light) { return std::span<float>(light.position); },
    .is_common = true};
inline constexpr LampField kDirection{
    .name = "direction",
    .label = "direction",
    .json = {"direction"},
    .rule = FieldRule::kUnitVector,
    .values = [](Light& light) { return std::span<float>(light.direction); },
    .is_common = true};
inline constexpr LampField kColor{
    .name = "color",
    .json = {"color"},
    .rule = FieldRule::kNotNegative,
    .values = [](Light& light) { return std::span<float>(light.color); },
    .is_common = true};
inline constexpr LampField kIntensity{
    .name = "intensity",
    .json = {"intensity"},
    .rule = FieldRule::kNotNegative,
    .values = [](Light& light) { return std::span<float>(&light.intensity, 1); },
    .is_common = true};
inline constexpr LampField kRange{
    .name = "range",
    .json = {"range"},
    .rule = FieldRule::kNotNegative,
    .values = [](Light& light) { return std::span<float>(&light.range, 1); },
    .is_common = true};
inline constexpr LampField kCone{.name = "cone angle",
                                 .json = {"spot"},
                                 .rule = FieldRule::kCone,
                                 .values = [](Light&) { return std::span<float>(); },
                                 .is_common = true};
inline constexpr LampField kRadius{
    .name = "radius",
    .label = "radius",
    .json = {"radius"},
    .rule = FieldRule::kLength,
    .values = [](Light& light) { return std::span<float>(&light.radius, 1); }};
inline constexpr LampField kSize{
    .name = "size",
    .label = "size",
    .json = {"width", "height"},
    .rule = FieldRule::kLength,
    .values = [](Light& light) { return std::span<float>(light.size); }};
/// For kinds that always need a tangent. Others need it only with a profile (check_light).
inline constexpr LampField kTangent{
    .name = "tangent",
    .label = "first side",
    .json = {"tangent"},
    .rule = FieldRule::kAcross,
    .values = [](Light& light) { return std::span<float>(light.tangent); }};
inline constexpr LampField kProfile{
    .name = "profile", .json = {"ies"}, .rule = FieldRule::kProfile, .values = [](Light&) {
      return std::span<float>();
    }};

/// The fields of every kind, and those that LIGHTS.json may give to every kind.
inline constexpr std::array kCommonFields = {&kPosition,  &kDirection, &kColor,
                                             &kIntensity, &kRange,     &kCone};

/// Throws Error that names the field if `light` breaks the field's rule.
void check_field(const Light& light, const LampField& field);

}  // namespace rebounce
