#include "precompute/compression/matrix_free_transfer.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "precompute/base/thread_limit.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/panel_compressor.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/inverse/hierarchical_matrix.h"
#include "precompute/inverse/solved_matrix.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/patches/patch_selection.h"
#include "transfer/base/error.h"
#include "transfer/base/version.h"
#include "transfer/file/content_hash.h"
#include "transfer/file/transfer_file.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {
namespace {

// Of the tolerance, the residual that columns are solved to. Measured: notes/operator.md.
constexpr double kResidualPart = 0.35;

// What form factors for the steps of columns are compressed to, in tolerances of the operator.
// Measured: notes/operator.md.
constexpr double kCoarsePart = 4;

// The multiplier of a value in the first stage, in first multipliers of the search for the
// tolerance. Errors go about like the root of the multiplier: a quarter of what the second stage
// may do.
constexpr double kFinePart = 1.0 / 16;

// For the progress alone: what is done before the first panel, and again before the first round of
// the second stage, and all rounds together, in columns that are solved for.
constexpr double kColumnsBefore = 5500, kColumnsOfRounds = 6000;

// Bytes a patch of lights: each, a copy and what it leads to; of those that shape, how they fall on
// clusters too.
constexpr std::size_t kLightBytes =
    3 * sizeof(Float3) * (kMostTrainingLights + kMostValidationLights) +
    sizeof(double) * kMostTrainingLights;

// Bytes a patch, for each matrix, of the operator of the first stage and the rounds of the second:
// an upper estimate, as they are only known later, at a tolerance, with the power by which less of
// that takes more.
constexpr double kOperatorBytes = 10.5e3, kOperatorTolerance = 0.005, kOperatorGrowth = 0.4;

/// Throws Error unless the limit, if there is one, has room for a plan.
void check_memory(std::size_t patch_count, const MatrixFreeTransferPlan& plan,
                  std::uint64_t limit) {
  if (limit == 0 || plan.peak_bytes <= limit) return;
  throw Error("an operator over " + std::to_string(patch_count) + " patches needs " +
              std::to_string(plan.peak_bytes >> 20) + " MiB at the least and may have " +
              std::to_string(limit >> 20) +
              " MiB; raise the memory limit or ask for fewer patches");
}

template <typename T>
void update(ContentHash& hash, std::span<const T> values) {
  const std::uint64_t count = values.size();
  hash.update(std::as_bytes(std::span(&count, 1)));
  hash.update(std::as_bytes(values));
}

/// Form factors as the steps of columns take them.
HierarchicalStorage coarser(const HierarchicalOperator& form_factors, const PatchTable& patches,
                            const FittingLights& lights, double tolerance) {
  return compress_matrix(HierarchicalMatrix(form_factors.storage()), patches, lights.training,
                         initial_multiplier(kCoarsePart * tolerance, patches.size()));
}

/// A hash of all that the first stage depends on.
std::string first_key(const HierarchicalOperator& form_factors, const PatchTable& patches,
                      const FittingLights& lights, const PatchRoles& roles, double multiplier) {
  ContentHash hash;
  update(hash, std::span(std::string_view(version())));
  update<int>(hash, {{kFileFormatVersion}});
  update<double>(hash, {{multiplier, kResidualPart, kCoarsePart}});
  const HierarchicalStorage& f = form_factors.storage();
  update(hash, std::span(f.blocks));
  update(hash, f.values_f32.span());
  update(hash, f.values_f16.span());
  update(hash, f.bases_q16.span());
  update(hash, f.bases_q8.span());
  update<std::uint32_t>(hash, f.patch);
  update<float>(hash, patches.area);
  update<Float3>(hash, patches.centroid);
  update<Float3>(hash, patches.normal);
  update<Float3>(hash, patches.reflectance);
  update<std::uint8_t>(hash, roles.role);
  for (const std::vector<Float3>& light : lights.training) update<Float3>(hash, light);
  return hash.text();
}

/// A hash of all that the second stage depends on; `first`: that of the first.
std::string second_key(const std::string& first, const FittingLights& lights,
                       const HierarchicalSettings& settings) {
  ContentHash hash;
  update(hash, std::span(std::string_view(first)));
  update(hash, std::span(&settings.tolerance, 1));
  update(hash, std::span(std::string_view(precision_name(settings.precision))));
  for (const std::vector<Float3>& light : lights.validation) update<Float3>(hash, light);
  return hash.text();
}

}  // namespace

MatrixFreeTransferPlan plan_matrix_free_transfer(std::size_t patch_count, std::size_t matrix_count,
                                                 const MatrixFreeTransferSettings& settings) {
  constexpr std::size_t kBlasBytes = 45'000'000;  // of OpenBLAS, for each thread that multiplies
  constexpr std::size_t kVectors = 8;             // those of the solver, coefficients, entries of F
  constexpr std::size_t kBatchColumns = SolvedTransfer::kBatchColumns,
                        kWidth = PanelCompressor::kPanelWidth;
  const std::size_t group = kVectors * patch_count * kBatchColumns * sizeof(float);
  const std::size_t panel = patch_count * kWidth * matrix_count * sizeof(float);
  const std::size_t side =
      largest_piece(static_cast<std::uint32_t>(HierarchicalFormat::position_count(patch_count)));
  const std::size_t piece = side * side * matrix_count * (sizeof(float) + 3 * sizeof(double));
  const std::size_t groups_of_panel = matrix_count * kWidth / kBatchColumns;
  const std::uint64_t limit = settings.memory_limit_bytes;
  const double operators =
      kOperatorBytes * static_cast<double>(matrix_count) *
      wanted_part(settings.roles, patch_count) *
      std::pow(kOperatorTolerance / settings.compression.tolerance, kOperatorGrowth);
  const std::size_t kept = patch_count * kLightBytes +
                           static_cast<std::size_t>(static_cast<double>(patch_count) * operators);

  MatrixFreeTransferPlan plan;
  for (plan.thread_count = omp_get_max_threads();; --plan.thread_count) {
    const auto threads = static_cast<std::size_t>(plan.thread_count);
    plan.panel_count = (threads + groups_of_panel - 1) / groups_of_panel;
    plan.peak_bytes = std::max(plan.panel_count * panel + threads * group, threads * piece) +
                      threads * kBlasBytes + kept;
    if (limit == 0 || plan.peak_bytes <= limit || threads == 1) return plan;
  }
}

std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const MatrixFreeTransferSettings& settings,
    const Progress& progress) {
  const MatrixFreeTransferPlan plan =
      plan_matrix_free_transfer(patches.size(), distinct_channels(patches.reflectance), settings);
  check_memory(patches.size(), plan, settings.memory_limit_bytes);
  const double tolerance = settings.compression.tolerance;
  const double multiplier = kFinePart * initial_multiplier(tolerance, patches.size());
  const std::string key = first_key(form_factors, patches, lights, settings.roles, multiplier);
  const BlockCheckpoint panels(settings.checkpoint, key);

  const ThreadLimit limited(plan.thread_count);
  const SolvedTransfer solved(form_factors, coarser(form_factors, patches, lights, tolerance),
                              patches, kResidualPart * tolerance);
  const Eigen::VectorXd energies = solved.estimated_energies(settings.roles);
  const double work_after = kColumnsBefore + kColumnsOfRounds;
  double searching = 0;  // when the search of the second stage begins
  HierarchicalStorage fine;
  {
    PanelMatrix matrix(solved, energies, settings.roles);
    PanelCompressor stage(matrix, patches, lights.training, multiplier, plan.panel_count, panels);
    const double work = stage.work(), all = kColumnsBefore + work + work_after;
    report_progress(progress, kColumnsBefore / all);
    fine = stage.run(part_of(progress, kColumnsBefore / all, (kColumnsBefore + work) / all));
    searching = (2 * kColumnsBefore + work) / all;
  }
  const RoundedMatrix rounded(solved, energies, std::exchange(fine, {}));
  const BlockCheckpoint rounds(settings.checkpoint, second_key(key, lights, settings.compression));
  return compress_to_tolerance(rounded, patches, lights, settings.compression,
                               part_of(progress, searching, 1), rounds);
}

}  // namespace rebounce
