#include "runtime/lights/lamp_kind.h"

#include <algorithm>
#include <array>

// A kind without a case does not compile.
#pragma GCC diagnostic error "-Wswitch"

namespace rebounce {

extern const LampKind kPointLamp, kSpotLamp, kDirectionalLamp, kSphereLamp, kRectangleLamp,
    kDiscLamp;

namespace {

constexpr const LampKind* find(LightType type) {
  switch (type) {
    case LightType::kPoint:
      return &kPointLamp;
    case LightType::kSpot:
      return &kSpotLamp;
    case LightType::kDirectional:
      return &kDirectionalLamp;
    case LightType::kSphere:
      return &kSphereLamp;
    case LightType::kRectangle:
      return &kRectangleLamp;
    case LightType::kDisc:
      return &kDiscLamp;
  }
  return nullptr;
}

constexpr std::size_t count_kinds() {
  std::size_t count = 0;
  while (find(static_cast<LightType>(count)) != nullptr) ++count;
  return count;
}

constexpr auto kKinds = [] {
  std::array<const LampKind*, count_kinds()> kinds{};
  for (std::size_t k = 0; k < kinds.size(); ++k) kinds[k] = find(static_cast<LightType>(k));
  return kinds;
}();

}  // namespace

const LampKind& lamp_kind(LightType type) {
  return *kKinds[static_cast<std::size_t>(type)];
}

std::span<const LampKind* const> lamp_kinds() {
  return kKinds;
}

bool LampKind::uses(const LampField& field) const {
  return std::ranges::find(fields, &field) != fields.end();
}

}  // namespace rebounce
