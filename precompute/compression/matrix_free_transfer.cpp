#include "precompute/compression/matrix_free_transfer.h"

#include <string>
#include <utility>

#include "precompute/base/thread_limit.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/checkpoint_identity.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/panel_compressor.h"
#include "precompute/compression/tolerance_search.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/inverse/hierarchical_matrix.h"
#include "precompute/inverse/solved_matrix.h"
#include "precompute/inverse/solved_transfer.h"

namespace rebounce {
namespace {

// The residual of solved columns, as a fraction of the tolerance.
constexpr double kResidualPart = 0.35;  // lab/060: a smaller one changes no error

// The tolerance of the form factors that the steps multiply with, in tolerances of the operator.
constexpr double kCoarsePart = 4;  // lab/060: half of the time of all form factors

// The multiplier of the first stage, in initial multipliers of the search for the tolerance. Errors
// grow about like the square root of the multiplier: the first stage has a quarter of the error of
// the second.
constexpr double kFinePart = 1.0 / 16;  // lab/060: a coarser one takes no less time

// Only for progress: the work before the first panel, again before the first round of the second
// stage, and of all rounds together, in columns that are solved for (lab/059).
constexpr double kColumnsBefore = 5500, kColumnsOfRounds = 6000;

/// Form factors as the steps of columns take them.
HierarchicalStorage coarser(const HierarchicalOperator& form_factors, const PatchTable& patches,
                            const FittingLights& lights, double tolerance) {
  return compress_matrix(HierarchicalMatrix(form_factors.storage()), patches, lights.training,
                         initial_multiplier(kCoarsePart * tolerance, patches.size()));
}

}  // namespace

std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const MatrixFreeTransferSettings& settings,
    const Progress& progress) {
  const MatrixFreeTransferPlan plan =
      plan_matrix_free_transfer(patches.size(), distinct_channels(patches.reflectance), settings);
  check_memory(patches.size(), plan, settings);
  const double tolerance = settings.compression.tolerance;
  const double multiplier = kFinePart * initial_multiplier(tolerance, patches.size());
  const double numbers[] = {multiplier, kResidualPart, kCoarsePart};
  const std::string key =
      identity_of_panels(form_factors, patches, lights, settings.roles, numbers);
  const BlockCheckpoint panels(settings.checkpoint, key);

  const ThreadLimit limited(plan.thread_count);
  const SolvedTransfer solved(form_factors, coarser(form_factors, patches, lights, tolerance),
                              patches, kResidualPart * tolerance);
  const Eigen::VectorXd energies = solved.estimated_energies(settings.roles);
  const double work_after = kColumnsBefore + kColumnsOfRounds;
  double searching = 0;  // fraction of the progress at which the search of the second stage begins
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
  const BlockCheckpoint rounds(settings.checkpoint,
                               identity_of_rounds(key, lights, settings.compression));
  return compress_to_tolerance(rounded, patches, lights, settings.compression,
                               part_of(progress, searching, 1), rounds);
}

}  // namespace rebounce
