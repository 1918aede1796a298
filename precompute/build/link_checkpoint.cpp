#include "precompute/build/link_checkpoint.h"

#include <array>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <vector>

#include "precompute/base/identity.h"

namespace rebounce {
namespace {

constexpr char kName[] = "links";

/// What links are beside their arrays.
struct Numbers {
  double epsilon = 0;
  ClosureReport closure;
  std::uint64_t ray_count = 0, candidate_count = 0;
};
static_assert(std::is_trivially_copyable_v<Numbers>);

/// References to all arrays of a LinkBuild, which may be const.
template <typename Build>
auto arrays_of(Build& build) {
  auto& links = build.links;
  auto& sky = build.sky_cells;
  return std::tie(links.patch, links.first_child, links.count, links.pair, links.exchange_area,
                  links.gradient, links.scale, build.sky_visibility, build.absorbed,
                  sky.entry_begin, sky.entry_cell, sky.entry_part);
}

}  // namespace

std::string identity_of_links(const PatchModel& model, const PatchRoles& roles, bool judged,
                              const BuildSettings& decided) {
  Identity identity;
  const PatchTable& patches = model.patches;
  identity.add(patches.area, patches.centroid, patches.normal, patches.reflectance, roles.role);
  const DisplayMesh& mesh = model.mesh;
  identity.add(mesh.position, mesh.triangle, mesh.triangle_patch, mesh.back_triangle,
               mesh.opacity.triangle_map, mesh.opacity.begin, mesh.opacity.opacity,
               model.shown_patch);
  const FormFactorSettings& f = decided.form_factors;
  identity.add(std::array{f.seed, decided.memory_limit_bytes, std::uint64_t{judged}},
               std::array{f.probe_rays, f.full_rays, f.hemisphere_rays},
               std::array{f.kernel_tolerance, f.link_epsilon, decided.tolerance});
  return identity.text();
}

void keep_links(const Checkpoint& checkpoint, const LinkBuild& build, double epsilon) {
  const std::vector<Numbers> numbers = {
      {epsilon, build.closure, build.ray_count, build.candidate_count}};
  std::apply([&](const auto&... arrays) { checkpoint.keep(kName, numbers, arrays...); },
             arrays_of(build));
}

bool find_kept_links(const Checkpoint& checkpoint, LinkBuild& build, double& epsilon) {
  std::vector<Numbers> numbers;
  const bool found =
      std::apply([&](auto&... arrays) { return checkpoint.find(kName, numbers, arrays...); },
                 arrays_of(build));
  if (!found) return false;
  epsilon = numbers.at(0).epsilon;
  build.closure = numbers[0].closure;
  build.ray_count = numbers[0].ray_count;
  build.candidate_count = numbers[0].candidate_count;
  return true;
}

}  // namespace rebounce
