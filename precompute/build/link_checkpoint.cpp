#include "precompute/build/link_checkpoint.h"

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <type_traits>
#include <vector>

#include "precompute/base/identity.h"
#include "precompute/base/ranks.h"

namespace rebounce {
namespace {

constexpr char kName[] = "links";

/// What links are beside their arrays.
struct Numbers {
  double epsilon = 0;
  LinkLimits limits;
  ClosureReport closure;
  std::uint64_t ray_count = 0, candidate_count = 0;
};
static_assert(std::is_trivially_copyable_v<Numbers>);

/// References to all arrays, which may be const.
template <typename Links, typename Escaped>
auto arrays_of(Links& links, Escaped& escaped) {
  auto& sky = escaped.sky_cells;
  return std::tie(links.patch, links.first_child, links.count, links.pair, links.exchange_area,
                  links.gradient, links.scale, escaped.sky_visibility, escaped.absorbed,
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
  identity.add(std::array{f.seed, std::uint64_t{judged}},
               std::array{f.probe_rays, f.full_rays, f.hemisphere_rays},
               std::array{f.kernel_tolerance, f.link_epsilon, decided.tolerance});
  return identity.text();
}

void keep_links(const Checkpoint& checkpoint, const JudgedLinks& links) {
  if (!checkpoint.keeps()) return;
  const LinkBuild& build = links.build;
  const FormFactorLinks flat = flat_links(*build.form_factors);
  const std::vector<Numbers> numbers = {
      {links.epsilon, links.limits, build.closure, build.ray_count, build.candidate_count}};
  std::apply([&](const auto&... arrays) { checkpoint.keep(kName, numbers, arrays...); },
             arrays_of(flat, build));
}

bool find_kept_links(const Checkpoint& checkpoint, const PatchTable& patches,
                     std::uint64_t memory_limit_bytes, JudgedLinks& links) {
  Ranks().share(std::span(&memory_limit_bytes, 1));  // item 0 is that of rank 0
  std::vector<Numbers> numbers;
  LinkBuild& build = links.build;
  FormFactorLinks flat;
  const bool found =
      std::apply([&](auto&... arrays) { return checkpoint.find(kName, numbers, arrays...); },
                 arrays_of(flat, build));
  if (!found || memory_limit_bytes < numbers.at(0).limits.least ||
      memory_limit_bytes >= numbers[0].limits.end) {
    links = {};
    return false;
  }
  links.epsilon = numbers[0].epsilon;
  links.limits = numbers[0].limits;
  build.form_factors =
      std::make_shared<const LinkedFormFactors>(flat, patches.area, patches.centroid);
  build.closure = numbers[0].closure;
  build.ray_count = numbers[0].ray_count;
  build.candidate_count = numbers[0].candidate_count;
  return true;
}

}  // namespace rebounce
