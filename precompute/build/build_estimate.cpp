#include "precompute/build/build_estimate.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>

#include "precompute/base/process_memory.h"
#include "precompute/build/operator_stage.h"
#include "precompute/compression/matrix_free_plan.h"
#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/machine_memory.h"

namespace rebounce {
namespace {

// Memory of each stage at its peak, by its arrays where they are counted and else as measured
// (lab/114). What a stage frees is given back at its end.

// An entry of an ExchangeMatrix: a column and an exchange area.
constexpr std::size_t kEntryBytes = sizeof(std::uint32_t) + sizeof(float);

// A pair while form factors are computed: in rows, and as its hemisphere rays count it, or in the
// matrix that rows are copied to (lab/174).
constexpr std::size_t kPairBytesMade = sizeof(ExchangeEntry) + 12;

// A pair beside a dense operator that is checked: in the matrix, and expanded to rows.
constexpr std::size_t kPairBytesKept = 2 * kEntryBytes;

// A patch while form factors are computed: its points, and what its hemisphere rays meet beside
// pairs that are counted already (lab/174).
constexpr std::size_t kPatchBytesOfPairs = 5000;

// A micro-triangle of an opacity map, where points are chosen on patches.
constexpr std::size_t kMicroTriangleBytes = 44;

// Weights at the vertices of the mesh: of each, and of those that several patches are near to, of
// which a patch has this many at most.
constexpr std::size_t kVertexBytes = 400, kWeighedBytes = 3000, kWeighedOfPatch = 10;

// What libraries take when they are first used, Embree and OpenBLAS above all: the latter in
// proportion to the products, up to the size of its buffers.
constexpr std::size_t kLibraryBytes = 2'000'000, kLibraryBytesOfPatch = 20'000,
                      kMostLibraryBytes = 12'000'000;

// Copies of the factors of a low-rank operator while they are found.
constexpr std::size_t kFactorCopies = 6;

// A link while links are found: the link, and what its rays are counted in or what gathers along it
// when it is checked (lab/171).
constexpr std::size_t kLinkBytesFound = 60;
// A patch then: its parts, what its hemisphere rays meet, the lights of the check (lab/171).
constexpr std::size_t kPatchBytesOfLinks = 11'500;

// A link afterwards: what gathers along it, twice, where some seven links of ten have no gradients
// (lab/169), and compressed form factors, which grow with links (lab/177).
constexpr std::size_t kLinkBytesKept = 46;

// How many more links there are once those that are too coarse have been made finer, as a part of
// those that are forecast: between none and 1.4 times, by the scene. What is said lies in between
// and grows with the patches up to a limit (lab/137).
constexpr double kMoreLinksOfPatch = 1.0 / 12'000, kMostMoreLinks = 0.6;

// Patches of flat surfaces for each square of their largest length, which is the diagonal of the
// box around them.
constexpr double kPatchesOfSquare = 2;

// More patches than any build has room for.
constexpr double kNoRoom = 1e15;

// What else a patch takes of compressed form factors, for each patch up to a limit (lab/177).
constexpr double kPatchBytes = 3200, kPatchBytesOfPatch = 0.23;

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

/// The number of patches that the settings ask for; from a size at least those of the triangles
/// that are larger than its square.
double least_patch_count(const Scene& scene, const SubdivisionSettings& settings) {
  const double wanted =
      settings.patch_count > 0 ? static_cast<double>(settings.patch_count) : kNoRoom;
  const double size = settings.patch_size;
  if (size == 0) return std::min(wanted, kNoRoom);
  double area = 0;
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    const double of_triangle = area_of(corners_of(scene, t));
    if (of_triangle > size * size) area += of_triangle;
  }
  return std::min({wanted, kNoRoom, kPatchesOfSquare * area / (size * size)});
}

std::uint64_t bytes_beside_transfer(const LinkedBuild& build) {
  const auto n = static_cast<double>(build.scene.patch_count);
  const double form_factors = std::min(kPatchBytes, kPatchBytesOfPatch * n) * n;
  return build.held_bytes + static_cast<std::uint64_t>(form_factors) +
         kLinkBytesKept * build.link_count;
}

std::uint64_t bytes_of_libraries(std::size_t patch_count) {
  return std::min(kMostLibraryBytes, kLibraryBytes + kLibraryBytesOfPatch * patch_count);
}

PairsBuild pairs_build(const PatchModel& model, const BuildSettings& decided) {
  return pairs_build(built_scene(model, decided), distinct_channels(model.patches.reflectance),
                     decided);
}

MatrixFreeTransferPlan plan_after_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  MatrixFreeTransferSettings settings{.compression = {.tolerance = build.tolerance},
                                      .roles = build.roles};
  settings.memory_limit_bytes = memory_of_matrix_free_transfer(build, limit_bytes);
  return plan_matrix_free_transfer({.patch_count = build.scene.patch_count,
                                    .matrix_count = build.matrix_count,
                                    .open_part = build.open_part},
                                   settings);
}

std::uint64_t bytes_of_weights(const BuiltScene& scene) {
  return kVertexBytes * scene.vertex_count +
         kWeighedBytes * std::min(scene.vertex_count, kWeighedOfPatch * scene.patch_count);
}

}  // namespace

std::uint64_t memory_limit_bytes(const BuildSettings& settings) {
  return settings.memory_limit_bytes > 0 ? settings.memory_limit_bytes : machine_memory_bytes() / 2;
}

BuiltScene built_scene(std::size_t patch_count, const DisplayMesh& mesh) {
  BuiltScene scene{.patch_count = patch_count, .vertex_count = mesh.position.size()};
  for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
    scene.micro_triangle_count += mesh.opacity.of_triangle(t).size();
  }
  return scene;
}

BuiltScene built_scene(const PatchModel& model, const BuildSettings& decided) {
  BuiltScene scene = built_scene(model.patches.size(), model.mesh);
  const ReceiverRowSettings& rows = decided.receiver_rows;
  if (!rows.any()) return scene;
  const std::uint64_t n = scene.patch_count, rays = static_cast<std::uint64_t>(rows.ray_count);
  const std::uint64_t texels = std::uint64_t{decided.lightmap.size} * decided.lightmap.size;
  const std::uint64_t receivers =
      (rows.at_vertices ? scene.vertex_count : 0) + (rows.at_texels ? texels : 0);
  scene.row_bytes =
      sizeof(std::uint64_t) * n * std::min(n, rays) + 4 * std::uint64_t{rows.most_sets} * receivers;
  return scene;
}

LinkedBuild linked_build(const BuiltScene& scene, std::size_t link_count, std::uint64_t link_bytes,
                         const PatchTable& patches, const PatchRoles& roles, double tolerance) {
  const std::uint64_t held = resident_memory_bytes();
  return {.scene = scene,
          .held_bytes = held - std::min(held, link_bytes),
          .link_count = link_count,
          .matrix_count = distinct_channels(patches.reflectance),
          .roles = roles,
          .tolerance = tolerance,
          .open_part = mean_open_part(patches.sky_visibility)};
}

PairsBuild pairs_build(const BuiltScene& scene, std::size_t matrix_count,
                       const BuildSettings& settings) {
  return {.scene = scene,
          .held_bytes = resident_memory_bytes(),
          .pair_count = scene.patch_count * scene.patch_count / 4,
          .matrix_count = matrix_count,
          .kind = settings.operator_kind,
          .rank = settings.rank};
}

std::uint64_t peak_bytes_of_pairs(const PairsBuild& build) {
  const BuiltScene& scene = build.scene;
  const std::uint64_t n = scene.patch_count, kept = kEntryBytes * build.pair_count;
  const std::uint64_t found = kPairBytesMade * build.pair_count + kPatchBytesOfPairs * n +
                              kMicroTriangleBytes * scene.micro_triangle_count;
  const std::uint64_t before = build.held_bytes + bytes_of_libraries(scene.patch_count);
  const std::uint64_t most = std::max(found, kept + bytes_of_weights(scene));
  if (build.kind == OperatorKind::kNoOperator) return before + most;
  const std::uint64_t inverses =
      dense_transfer_peak_bytes(scene.patch_count, build.matrix_count, arithmetic_of(build.kind));
  const std::uint64_t inverse = n * n / 2 * build.matrix_count * sizeof(float);
  std::uint64_t last = kPairBytesKept * build.pair_count + inverse;
  if (build.kind == OperatorKind::kHierarchical) {
    last = kept + dense_compression_peak_bytes(scene.patch_count, build.matrix_count);
  } else if (build.kind == OperatorKind::kLowRank) {
    const std::uint64_t factors = kFactorCopies * n * std::min<std::uint64_t>(build.rank, n);
    last = kept + inverse + factors * build.matrix_count * sizeof(float);
  }
  return before + std::max({most, kept + inverses, last, kept + scene.row_bytes});
}

std::uint64_t peak_bytes_of_links(const LinkedBuild& build) {
  return build.held_bytes + kPatchBytesOfLinks * build.scene.patch_count +
         kLinkBytesFound * build.link_count +
         kMicroTriangleBytes * build.scene.micro_triangle_count;
}

std::uint64_t peak_bytes_after_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  return bytes_beside_transfer(build) +
         std::max({plan_after_links(build, limit_bytes).peak_bytes, bytes_of_weights(build.scene),
                   build.scene.row_bytes});
}

int thread_count_after_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  return plan_after_links(build, limit_bytes).thread_count;
}

std::uint64_t memory_of_matrix_free_transfer(const LinkedBuild& build, std::uint64_t limit_bytes) {
  const std::uint64_t beside = bytes_beside_transfer(build);
  return limit_bytes > beside ? limit_bytes - beside : 1;
}

std::size_t finer_link_count(std::size_t forecast, std::size_t patch_count) {
  const double more =
      std::min(kMostMoreLinks, kMoreLinksOfPatch * static_cast<double>(patch_count));
  return static_cast<std::size_t>((1 + more) * static_cast<double>(forecast));
}

CostEstimate estimate_cost(const PatchModel& model, const PatchRoles& roles,
                           const BuildSettings& decided, std::size_t link_count) {
  CostEstimate estimate = estimate_of(model.patches.size(), roles);
  if (decided.exchange_source == ExchangeSource::kPairs) {
    estimate.peak_bytes = peak_bytes_of_pairs(pairs_build(model, decided));
    return estimate;
  }
  const LinkedBuild build = linked_build(built_scene(model, decided), link_count, 0, model.patches,
                                         roles, kCompressionPart * decided.tolerance);
  estimate.peak_bytes = peak_bytes_of_links(build);
  if (decided.operator_kind != OperatorKind::kNoOperator) {
    estimate.peak_bytes =
        std::max(estimate.peak_bytes, peak_bytes_after_links(build, decided.memory_limit_bytes));
  }
  return estimate;
}

void sample_pairs(const PatchModel& model, const RayTracer& tracer, const BuildSettings& decided,
                  const Progress& progress, CostEstimate& estimate) {
  PairsBuild build = pairs_build(model, decided);
  const FormFactorForecast forecast =
      forecast_form_factors(model, tracer, decided.form_factors, progress);
  build.pair_count = static_cast<std::size_t>(forecast.entry_count);
  estimate.peak_bytes = peak_bytes_of_pairs(build);
  estimate.form_factor_seconds = forecast.seconds;
  if (decided.operator_kind == OperatorKind::kNoOperator) return;
  estimate.inverse_seconds =
      forecast_dense_transfer(estimate.patch_count, distinct_channels(model.patches.reflectance),
                              measure_tile_speed(arithmetic_of(decided.operator_kind)));
}

CostEstimate least_cost(const Scene& scene, const SubdivisionSettings& settings) {
  const auto count = static_cast<std::size_t>(least_patch_count(scene, settings));
  CostEstimate estimate = estimate_of(count, {});
  if (count <= kPairsPatchCount) return estimate;
  estimate.peak_bytes =
      peak_bytes_of_links({.scene = {count}, .held_bytes = resident_memory_bytes()});
  return estimate;
}

CostEstimate estimate_after_links(const LinkedBuild& build, std::uint64_t limit_bytes) {
  CostEstimate estimate = estimate_of(build.scene.patch_count, build.roles);
  estimate.link_count = build.link_count;
  estimate.peak_bytes = peak_bytes_after_links(build, limit_bytes);
  return estimate;
}

TakenMemory::TakenMemory() : before_(peak_memory_bytes()) {}

std::uint64_t TakenMemory::bytes() const {
  constexpr std::uint64_t kMiB = 1 << 20;  // more than it takes to ask for the peak
  const std::uint64_t peak = peak_memory_bytes();
  return peak > before_ + kMiB ? peak : 0;
}

void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count) {
  if (estimate.peak_bytes <= limit_bytes) return;
  throw Error(fmt::format(
      "{} patches (from {} triangles) need about {}, the limit is {}; ask for "
      "fewer or larger patches, simplify the scene or raise the memory limit (--memory-limit)",
      estimate.patch_count, triangle_count, in_gib(estimate.peak_bytes), in_gib(limit_bytes)));
}

}  // namespace rebounce
