#include "build_estimate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "rebounce/precompute/dense_transfer.h"
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

}  // namespace

CostEstimate estimate_cost(const PatchModel& model, const BuildSettings& settings) {
  const PatchTable& patches = model.patches;
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  const std::uint32_t matrices = distinct_channels(patches.reflectance, channel_matrix);
  const auto n = static_cast<double>(patches.size());
  CostEstimate estimate;
  estimate.patch_count = patches.size();
  // Form factors at their fullest: half of all pairs, 16 bytes each while they are made and 24 when
  // they are compressed and expanded; then the inversion beside the compressed ones.
  const double factors = n * n / 4;
  estimate.peak_bytes = static_cast<std::uint64_t>(std::max(
      40 * factors,
      8 * factors + static_cast<double>(dense_transfer_peak_bytes(patches.size(), matrices))));
  // Ten million rays, fifty billion operations and eighty thousand vertices a second, about one
  // slow core.
  estimate.seconds = factors * settings.form_factors.probe_rays / 1e7 +
                     2 * n * n * n * matrices / 5e10 +
                     static_cast<double>(model.mesh.position.size()) / 8e4;
  return estimate;
}

void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count) {
  const std::uint64_t limit = limit_bytes > 0 ? limit_bytes : machine_memory_bytes() / 2;
  if (estimate.peak_bytes <= limit) return;
  throw Error(fmt::format(
      "{} patches (from {} triangles) need about {} and the limit is {}; ask for "
      "fewer patches, simplify the scene or raise --memory-limit",
      estimate.patch_count, triangle_count, in_gib(estimate.peak_bytes), in_gib(limit)));
}

}  // namespace rebounce
