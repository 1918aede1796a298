#include "precompute/build/build_estimate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "precompute/base/process_memory.h"
#include "precompute/build/operator_stage.h"
#include "precompute/compression/matrix_free_plan.h"
#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "rebounce/error.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {
namespace {

// Memory of each stage at its peak. Arrays that grow by doubling count with their spare capacity,
// and with both copies while they move.

// An entry of an ExchangeMatrix: a column and an exchange area.
constexpr std::size_t kEntryBytes = sizeof(std::uint32_t) + sizeof(float);

// A pair while form factors are computed: in rows, and in the matrix that they are copied to.
constexpr std::size_t kPairBytesMade = sizeof(ExchangeEntry) + 3 * kEntryBytes;

// A pair beside a dense inverse: in the matrix, and expanded to rows that hold it twice.
constexpr std::size_t kPairBytesKept = 2 * kEntryBytes + 2 * kEntryBytes;

// What libraries take when they are first used, Embree and OpenBLAS above all (lab/106).
constexpr std::size_t kLibraryBytes = 12'000'000;

// A link during refinement: the link, its copy, and the flat arrays.
constexpr std::size_t kLinkBytesFound = 4 * sizeof(Link);

// A link afterwards: the flat arrays, and the gathering order by both nodes.
constexpr std::size_t kFlatLinkBytes = sizeof(FormFactorLinks{}.pair[0]) +
                                       sizeof(FormFactorLinks{}.exchange_area[0]) +
                                       sizeof(FormFactorLinks{}.gradient[0]);
constexpr std::size_t kLinkBytesKept = 2 * kFlatLinkBytes + LinkedFormFactors::kBytesPerLink;

// Upper estimate of the memory of a patch beside links: its triangles, in the mesh and in the ray
// tracer; radiosities under 274 lights; compressed form factors.
constexpr std::size_t kPatchBytes = 8000;

// Upper estimate of the links of a patch over the cube root of the number of patches:
// furnished rooms have 10 to 10.5, empty ones a quarter of it (lab/059).
constexpr double kFurnishedLinks = 11;

std::uint64_t machine_memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

std::string in_gib(std::uint64_t bytes) {
  return fmt::format("{:.3g} GiB", static_cast<double>(bytes) / (1ULL << 30));
}

CostEstimate estimate_of(std::size_t patch_count, const PatchRoles& roles) {
  CostEstimate estimate;
  estimate.patch_count = patch_count;
  estimate.receiver_count = roles.count(PatchRoles::kReceiver, patch_count);
  estimate.source_count = roles.count(PatchRoles::kSource, patch_count);
  return estimate;
}

std::uint64_t bytes_beside_transfer(const LinkedBuild& build) {
  return kPatchBytes * build.patch_count + kLinkBytesKept * build.link_count;
}

std::size_t links_of_furnished_room(std::size_t patch_count) {
  const auto n = static_cast<double>(patch_count);
  return static_cast<std::size_t>(kFurnishedLinks * std::cbrt(n) * n);
}

/// Rows of vertices: of the patches, as sparse as rays leave them, and twice what is stored.
std::uint64_t bytes_of_receiver_rows(const PatchModel& model, const ReceiverRowSettings& rows) {
  if (!rows.at_vertices) return 0;
  const std::uint64_t n = model.patches.size(), rays = static_cast<std::uint64_t>(rows.ray_count);
  return sizeof(std::uint64_t) * n * std::min(n, rays) +
         4 * std::uint64_t{rows.most_sets} * model.mesh.position.size();
}

}  // namespace

std::uint64_t memory_limit_bytes(const BuildSettings& settings) {
  return settings.memory_limit_bytes > 0 ? settings.memory_limit_bytes : machine_memory_bytes() / 2;
}

std::uint64_t peak_bytes_of_pairs(std::size_t patch_count, std::size_t matrix_count,
                                  OperatorKind kind) {
  const std::uint64_t pairs = static_cast<std::uint64_t>(patch_count) * patch_count / 4;
  const std::uint64_t inverses =
      kind == OperatorKind::kNoOperator
          ? 0
          : dense_transfer_peak_bytes(patch_count, matrix_count, arithmetic_of(kind));
  const std::uint64_t compression = kind == OperatorKind::kHierarchical
                                        ? dense_compression_peak_bytes(patch_count, matrix_count)
                                        : 0;
  return resident_memory_bytes() + kLibraryBytes +
         std::max({kPairBytesMade * pairs, kPairBytesKept * pairs + inverses,
                   kEntryBytes * pairs + compression});
}

std::uint64_t peak_bytes_of_links(const LinkedBuild& build) {
  return kPatchBytes * build.patch_count + kLinkBytesFound * build.link_count;
}

std::uint64_t peak_bytes_after_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  MatrixFreeTransferSettings settings{.compression = {.tolerance = build.tolerance},
                                      .roles = build.roles};
  settings.memory_limit_bytes = memory_of_matrix_free_transfer(build, limit_bytes);
  return bytes_beside_transfer(build) +
         plan_matrix_free_transfer(build.patch_count, build.matrix_count, settings).peak_bytes;
}

std::uint64_t memory_of_matrix_free_transfer(const LinkedBuild& build, std::uint64_t limit_bytes) {
  const std::uint64_t beside = bytes_beside_transfer(build);
  return limit_bytes > beside ? limit_bytes - beside : 1;
}

CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& decided) {
  const std::size_t n = model.patches.size();
  const std::uint32_t matrices = distinct_channels(model.patches.reflectance);
  CostEstimate estimate = estimate_of(n, roles);
  if (decided.exchange_source == ExchangeSource::kPairs) {
    estimate.peak_bytes = peak_bytes_of_pairs(n, matrices, decided.operator_kind) +
                          bytes_of_receiver_rows(model, decided.receiver_rows);
    return estimate;
  }
  const LinkedBuild build{n, links_of_furnished_room(n), matrices, roles, decided.tolerance};
  estimate.peak_bytes = peak_bytes_of_links(build);
  if (decided.operator_kind != OperatorKind::kNoOperator) {
    estimate.peak_bytes =
        std::max(estimate.peak_bytes, peak_bytes_after_links(build, decided.memory_limit_bytes) +
                                          bytes_of_receiver_rows(model, decided.receiver_rows));
  }
  return estimate;
}

void sample_pairs(const PatchModel& model, const RayTracer& tracer, const BuildSettings& decided,
                  const Progress& progress, CostEstimate& estimate) {
  estimate.form_factor_seconds =
      forecast_form_factors(model, tracer, decided.form_factors, progress).seconds;
  if (decided.operator_kind == OperatorKind::kNoOperator) return;
  estimate.inverse_seconds =
      forecast_dense_transfer(estimate.patch_count, distinct_channels(model.patches.reflectance),
                              arithmetic_of(decided.operator_kind));
}

CostEstimate estimate_after_links(const PatchModel& model, std::size_t link_count,
                                  const PatchRoles& roles, const BuildSettings& decided) {
  const LinkedBuild build{model.patches.size(), link_count,
                          distinct_channels(model.patches.reflectance), roles, decided.tolerance};
  CostEstimate estimate = estimate_of(build.patch_count, roles);
  estimate.link_count = link_count;
  estimate.peak_bytes = peak_bytes_after_links(build, decided.memory_limit_bytes) +
                        bytes_of_receiver_rows(model, decided.receiver_rows);
  return estimate;
}

void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count) {
  if (estimate.peak_bytes <= limit_bytes) return;
  throw Error(fmt::format(
      "{} patches (from {} triangles) need about {}, the limit is {}; ask for "
      "fewer patches, simplify the scene or raise --memory-limit",
      estimate.patch_count, triangle_count, in_gib(estimate.peak_bytes), in_gib(limit_bytes)));
}

}  // namespace rebounce
