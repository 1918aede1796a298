#include "build_estimate.h"

#include <fmt/format.h>
#include <omp.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "operator_stage.h"
#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/large_transfer.h"
#include "rebounce/precompute/patch_selection.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

std::uint64_t machine_memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

std::string in_gib(std::uint64_t bytes) {
  return fmt::format("{:.3g} GiB", static_cast<double>(bytes) / (1ULL << 30));
}

double on_all_processors(double processor_seconds) {
  return processor_seconds / omp_get_max_threads();
}

double seconds_of_vertices(std::size_t vertex_count) {
  return static_cast<double>(vertex_count) / 8e4;
}

// Processor seconds to compress the dense inverse of so many patches, and how they grow, where a
// core does so many operations a second; the part of its speed that a dense inverse has. Measured:
// notes/operator.md.
constexpr double kCompressPairs = 3.4e-4, kCompressPairsGrowth = 1.3, kUsualOperations = 2e11;
constexpr double kInverseShare = 0.7;

// Where neither has been measured: rays of a pair (as many as it begins with, if links tell what is
// seen), rays a second, operations a second, of a slow core.
constexpr double kGuessedRays = 100, kGuessedRaySpeed = 1e7, kGuessedOperations = 7e10;

// Links of a patch where there are kLinkPatches of them, and how their number grows: in a bare room
// and in a furnished one. Measured: notes/links.md, notes/operator.md. Rooms full of small things
// have more.
constexpr double kBareLinks = 45;
constexpr double kFurnishedLinks = 165, kLinkPatches = 4000, kLinkGrowth = 0.32;

// Bytes of a link while they are found, and afterwards with the copy that gathers; bytes of a patch
// beside them.
constexpr double kLinkPeakBytes = 160, kLinkBytes = 110, kPatchBytes = 8e3;

// Processor seconds, of about one slow core; measured: notes/links.md. To find links, by patches
// and links.
constexpr double kFindPatch = 6e-4, kFindLink = 1.7e-5;

// To gather eight lights along them once, and to compress F, likewise; both where there are
// kLargePatches, and growing with this power beside, as vectors leave the caches.
constexpr double kGatherPatch = 4e-6, kGatherLink = 1.25e-7;
constexpr double kCompressPatch = 5.5e-3, kCompressLink = 5e-6;
constexpr double kLargePatches = 64000, kGrowth = 1.0 / 3;

// To choose fewer links, by those that there are; links of a patch that are left.
constexpr double kChooseLink = 3.5e-6, kFewerLinks = 30;

// Groups of eight lights that are fitted to and measured with, and of each kind of the check, and
// gathers that each takes, those of the check three in single precision; groups that are only
// drawn; to draw a light, by patches.
constexpr double kFitGroups = 30, kFitGathers = 7, kCheckGroups = 32, kCheckGathers = 1.7;
constexpr double kOtherGroups = 56, kDrawPatch = 4e-7;

// Bytes of a patch of compressed form factors, with no links and for each link of it.
constexpr double kFormFactorBytes = 570, kFormFactorLinkBytes = 4;

CostEstimate estimate_of(std::size_t patch_count, const PatchRoles& roles) {
  CostEstimate estimate;
  estimate.patch_count = patch_count;
  estimate.receiver_count = roles.count(PatchRoles::kReceiver, patch_count);
  estimate.source_count = roles.count(PatchRoles::kSource, patch_count);
  return estimate;
}

/// Memory of the links and of all else that stays beside build_large_transfer.
double bytes_beside_transfer(const LinkedBuild& build) {
  return kPatchBytes * static_cast<double>(build.patch_count) +
         kLinkBytes * static_cast<double>(build.link_count);
}

/// What it would be with so many links to a patch.
LinkedBuild build_with(double links_per_patch, const PatchTable& patches, const PatchRoles& roles,
                       double tolerance) {
  const double links = links_per_patch * static_cast<double>(patches.size());
  return {.patch_count = patches.size(),
          .link_count = static_cast<std::size_t>(links),
          .matrix_count = distinct_channels(patches.reflectance),
          .roles = roles,
          .tolerance = tolerance};
}

CostEstimate estimate_cost_of_links(const PatchModel& model, const PatchRoles& roles,
                                    const BuildSettings& settings) {
  const std::uint64_t limit_bytes = memory_limit_bytes(settings);
  const auto n = static_cast<double>(model.patches.size());
  const double growth = std::pow(n / kLinkPatches, kLinkGrowth);
  const LinkedBuild furnished = build_with(kFurnishedLinks * growth, model.patches, roles,
                                           settings.tolerance),
                    bare = build_with(kBareLinks, model.patches, roles, settings.tolerance);
  const CostEstimate links = estimate_links(furnished),
                     rest = estimate_operator_from_links(furnished, limit_bytes);
  const double vertices = seconds_of_vertices(model.mesh.position.size());
  CostEstimate all = estimate_of(furnished.patch_count, roles);
  all.peak_bytes = std::max(links.peak_bytes, rest.peak_bytes);
  all.seconds = links.seconds + rest.seconds + vertices;
  all.whole_seconds = links.seconds + rest.whole_seconds + vertices;
  all.least_seconds = estimate_links(bare).seconds +
                      estimate_operator_from_links(bare, limit_bytes).seconds + vertices;
  return all;
}

}  // namespace

std::uint64_t memory_limit_bytes(const BuildSettings& settings) {
  return settings.memory_limit_bytes > 0 ? settings.memory_limit_bytes : machine_memory_bytes() / 2;
}

CostEstimate estimate_cost_of_pairs(const PatchModel& model, const PatchRoles& roles,
                                    const BuildSettings& settings,
                                    const std::optional<PairSpeed>& speed) {
  const PatchTable& patches = model.patches;
  const std::uint32_t matrices = distinct_channels(patches.reflectance);
  const auto n = static_cast<double>(patches.size());
  CostEstimate estimate = estimate_of(patches.size(), roles);
  // Form factors at their fullest: half of all pairs, 16 bytes each while they are made and 24 when
  // they are compressed and expanded; then the inversion beside the compressed ones and what is
  // left of finding them. Measured, furnished room: 0.30, 1.17 and 4.32 GB with 4,096, 8,192 and
  // 16,384.
  const double factors = n * n / 4;
  const Arithmetic arithmetic = arithmetic_of(settings.operator_kind);
  const std::size_t inverses = dense_transfer_peak_bytes(patches.size(), matrices, arithmetic);
  estimate.peak_bytes = static_cast<std::uint64_t>(
      std::max(40 * factors, 32 * factors + static_cast<double>(inverses)));
  const FormFactorSettings& form_factors = settings.form_factors;
  const double rays = form_factors.link_epsilon > 0 ? form_factors.probe_rays : kGuessedRays;
  const PairSpeed known =
      speed.value_or(PairSpeed{on_all_processors(factors * rays / kGuessedRaySpeed),
                               kGuessedOperations / on_all_processors(1)});
  const double operations =
      kInverseShare * known.operations_per_second * (arithmetic == Arithmetic::kDouble ? 0.5 : 1);
  estimate.whole_seconds = known.form_factor_seconds + 2 * n * n * n * matrices / operations +
                           seconds_of_vertices(model.mesh.position.size());
  estimate.seconds = estimate.whole_seconds;
  if (settings.operator_kind == OperatorKind::kHierarchical) {
    // Half of it is no product of matrices.
    const double slowness =
        std::sqrt(kUsualOperations / on_all_processors(1) / known.operations_per_second);
    estimate.seconds +=
        slowness * on_all_processors(kCompressPairs * std::pow(n, kCompressPairsGrowth) *
                                     wanted_part(roles, patches.size()));
  }
  estimate.least_seconds = estimate.seconds;
  return estimate;
}

CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& settings) {
  return settings.form_factor_kind == FormFactorKind::kLinks
             ? estimate_cost_of_links(model, roles, settings)
             : estimate_cost_of_pairs(model, roles, settings);
}

LinkedBuild linked_build(const FormFactorLinks& links, const PatchTable& patches,
                         std::span<const float> sky_visibility, const PatchRoles& roles,
                         double tolerance) {
  return {.patch_count = patches.size(),
          .link_count = links.pair.size(),
          .matrix_count = distinct_channels(patches.reflectance),
          .open = std::ranges::any_of(sky_visibility, [](float v) { return v > 0; }),
          .roles = roles,
          .tolerance = tolerance};
}

CostEstimate estimate_links(const LinkedBuild& build) {
  const auto n = static_cast<double>(build.patch_count),
             links = static_cast<double>(build.link_count);
  CostEstimate estimate = estimate_of(build.patch_count, build.roles);
  estimate.link_count = build.link_count;
  estimate.peak_bytes = static_cast<std::uint64_t>(kPatchBytes * n + kLinkPeakBytes * links);
  estimate.seconds = on_all_processors(kFindPatch * n + kFindLink * links);
  estimate.whole_seconds = estimate.seconds;
  estimate.least_seconds = estimate.seconds;
  return estimate;
}

CostEstimate estimate_operator_from_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  const auto n = static_cast<double>(build.patch_count),
             links = static_cast<double>(build.link_count);
  LargeTransferSettings settings{.compression = {.tolerance = build.tolerance},
                                 .roles = build.roles};
  settings.memory_limit_bytes = memory_of_large_transfer(build, limit_bytes);
  const LargeTransferPlan plan =
      plan_large_transfer(build.patch_count, build.matrix_count, settings);
  const double kinds = build.open ? 4 : 3;
  const double groups = kFitGroups + kOtherGroups + kinds * kCheckGroups;
  const double fewer = std::min(links, kFewerLinks * n);
  const double fitting = kFitGroups * kFitGathers * (kGatherPatch * n + kGatherLink * fewer);
  const double checking =
      kinds * kCheckGroups * kCheckGathers * (kGatherPatch * n + kGatherLink * links);
  const double compressing = kCompressPatch * n + kCompressLink * links;
  const double drawing = groups * ReferenceSolver::kTogether * kDrawPatch * n;
  const double growth = std::pow(n / kLargePatches, kGrowth);
  const double form_factors = kFormFactorBytes * n + kFormFactorLinkBytes * links;
  CostEstimate estimate = estimate_of(build.patch_count, build.roles);
  estimate.link_count = build.link_count;
  estimate.peak_bytes = static_cast<std::uint64_t>(bytes_beside_transfer(build)) + plan.peak_bytes;
  estimate.whole_seconds = on_all_processors(growth * (fitting + checking + compressing) +
                                             kChooseLink * links + drawing);
  estimate.seconds =
      estimate.whole_seconds +
      large_transfer_seconds(build.patch_count, build.matrix_count, form_factors, build.roles) /
          plan.thread_count;
  estimate.least_seconds = estimate.seconds;
  return estimate;
}

std::uint64_t memory_of_large_transfer(const LinkedBuild& build, std::uint64_t limit_bytes) {
  const auto beside = static_cast<std::uint64_t>(bytes_beside_transfer(build));
  return limit_bytes > beside ? limit_bytes - beside : 1;
}

void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count) {
  if (estimate.peak_bytes <= limit_bytes) return;
  throw Error(fmt::format(
      "{} patches (from {} triangles) need about {} and the limit is {}; ask for "
      "fewer patches, simplify the scene or raise --memory-limit",
      estimate.patch_count, triangle_count, in_gib(estimate.peak_bytes), in_gib(limit_bytes)));
}

}  // namespace rebounce
