#include "build_estimate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/large_transfer.h"
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

std::uint32_t matrix_count(const PatchTable& patches) {
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  return distinct_channels(patches.reflectance, channel_matrix);
}

double seconds_of_vertices(const PatchModel& model) {
  return static_cast<double>(model.mesh.position.size()) / 8e4;
}

// Links of a patch where there are kLinkPatches of them, and how their number grows; bytes of each
// while they are found, and afterwards with the copy that gathers; bytes of a patch beside them.
// Measured in furnished rooms, notes/links.md; rooms full of small things have more.
constexpr double kLinksPerPatch = 165, kLinkPatches = 4000, kLinkGrowth = 0.32;
constexpr double kLinkPeakBytes = 160, kLinkBytes = 110, kPatchBytes = 8e3;

// Links that are found in a second, and as many that lights are gathered along, to fit to and to
// check with; seconds of a column of the operator and matrix, by patches. About one slow core.
constexpr double kLinksPerSecond = 3e4, kColumnSeconds = 4e-7;

CostEstimate estimate_cost_of_links(const PatchModel& model) {
  const auto n = static_cast<double>(model.patches.size());
  const std::uint32_t matrices = matrix_count(model.patches);
  const double links = n * kLinksPerPatch * std::pow(n / kLinkPatches, kLinkGrowth);
  const auto transfer =
      static_cast<double>(large_transfer_peak_bytes(model.patches.size(), matrices));
  CostEstimate estimate;
  estimate.patch_count = model.patches.size();
  estimate.peak_bytes = static_cast<std::uint64_t>(
      kPatchBytes * n + std::max(kLinkPeakBytes * links, kLinkBytes * links + transfer));
  estimate.seconds =
      2 * links / kLinksPerSecond + kColumnSeconds * n * n * matrices + seconds_of_vertices(model);
  return estimate;
}

}  // namespace

std::uint64_t memory_limit_bytes(const BuildSettings& settings) {
  return settings.memory_limit_bytes > 0 ? settings.memory_limit_bytes : machine_memory_bytes() / 2;
}

CostEstimate estimate_cost_of_pairs(const PatchModel& model, const BuildSettings& settings) {
  const PatchTable& patches = model.patches;
  const std::uint32_t matrices = matrix_count(patches);
  const auto n = static_cast<double>(patches.size());
  CostEstimate estimate;
  estimate.patch_count = patches.size();
  // Form factors at their fullest: half of all pairs, 16 bytes each while they are made and 24 when
  // they are compressed and expanded; then the inversion beside the compressed ones.
  const double factors = n * n / 4;
  estimate.peak_bytes = static_cast<std::uint64_t>(std::max(
      40 * factors,
      8 * factors + static_cast<double>(dense_transfer_peak_bytes(patches.size(), matrices))));
  // Ten million rays and fifty billion operations a second, about one slow core.
  estimate.seconds = factors * settings.form_factors.probe_rays / 1e7 +
                     2 * n * n * n * matrices / 5e10 + seconds_of_vertices(model);
  return estimate;
}

CostEstimate estimate_cost(const PatchModel& model, const BuildSettings& settings) {
  return settings.form_factor_kind == FormFactorKind::kLinks
             ? estimate_cost_of_links(model)
             : estimate_cost_of_pairs(model, settings);
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
