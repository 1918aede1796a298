#include "transfer/data/patch_roles.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"

namespace rebounce {

std::size_t PatchRoles::count(std::uint8_t bit, std::size_t patch_count) const {
  if (all_are_both()) return patch_count;
  return static_cast<std::size_t>(
      std::ranges::count_if(role, [=](std::uint8_t bits) { return (bits & bit) != 0; }));
}

void PatchRoles::keep(std::uint8_t bit, std::span<Float3> light) const {
  if (all_are_both()) return;
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (!has(i, bit)) light[i] = {0, 0, 0};
  }
}

void check_roles(const PatchRoles& roles, std::size_t patch_count) {
  if (roles.all_are_both()) return;
  if (roles.role.size() != patch_count) {
    throw Error("there are " + std::to_string(roles.role.size()) + " roles for " +
                std::to_string(patch_count) + " patches");
  }
  const auto unknown =
      std::ranges::find_if(roles.role, [](std::uint8_t bits) { return bits > PatchRoles::kBoth; });
  if (unknown != roles.role.end()) {
    throw Error("the role of patch " + std::to_string(unknown - roles.role.begin()) + " is " +
                std::to_string(*unknown) + ", not at most " + std::to_string(PatchRoles::kBoth));
  }
  if (roles.count(PatchRoles::kReceiver, patch_count) == 0) throw Error("no patch is a receiver");
  if (roles.count(PatchRoles::kSource, patch_count) == 0) throw Error("no patch is a source");
}

}  // namespace rebounce
