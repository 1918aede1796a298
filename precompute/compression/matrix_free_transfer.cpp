#include "precompute/compression/matrix_free_transfer.h"

#include <optional>
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

/// The plan for `patches`. Throws Error if it does not fit into the memory limit.
MatrixFreeTransferPlan checked_plan(const PatchTable& patches,
                                    const MatrixFreeTransferSettings& settings) {
  const MatrixFreeTransferPlan plan =
      plan_matrix_free_transfer(patches.size(), distinct_channels(patches.reflectance), settings);
  check_memory(patches.size(), plan, settings);
  return plan;
}

}  // namespace

struct MatrixFreeTransfer::State {
  State(const HierarchicalOperator& form_factors, const PatchTable& of_patches,
        const FittingLights& lights, MatrixFreeTransferSettings with)
      : settings(std::move(with)),
        patches(of_patches),
        plan(checked_plan(patches, settings)),
        limited(std::in_place, plan.thread_count),
        multiplier(kFinePart * initial_multiplier(tolerance(), patches.size())),
        panels_key(identity_of_panels(form_factors, patches, lights, settings.roles,
                                      {{multiplier, kResidualPart, kCoarsePart}})),
        solved(form_factors, coarser(form_factors, patches, lights, tolerance()), patches,
               kResidualPart * tolerance()),
        energies(solved.estimated_energies(settings.roles)) {
    limited.reset();
  }

  double tolerance() const { return settings.compression.tolerance; }

  MatrixFreeTransferSettings settings;
  const PatchTable& patches;
  MatrixFreeTransferPlan plan;
  std::optional<ThreadLimit> limited;  ///< while the members below are made
  double multiplier;                   ///< of the first stage
  std::string panels_key;
  SolvedTransfer solved;
  Eigen::VectorXd energies;
  std::optional<RoundedMatrix> fine;  ///< what the first stage has compressed
  double solving_part = 0;
};

MatrixFreeTransfer::MatrixFreeTransfer(const HierarchicalOperator& form_factors,
                                       const PatchTable& patches, const FittingLights& lights,
                                       const MatrixFreeTransferSettings& settings,
                                       const Progress& progress)
    : state_(std::make_unique<State>(form_factors, patches, lights, settings)) {
  State& state = *state_;
  const ThreadLimit limited(state.plan.thread_count);
  const BlockCheckpoint panels(settings.checkpoint, state.panels_key);
  PanelMatrix matrix(state.solved, state.energies, settings.roles);
  PanelCompressor stage(matrix, patches, lights.training, state.multiplier, state.plan.panel_count,
                        panels);
  const double work = stage.work(), all = 2 * kColumnsBefore + work + kColumnsOfRounds;
  report_progress(progress, kColumnsBefore / all);
  state.fine.emplace(
      state.solved, state.energies,
      stage.run(part_of(progress, kColumnsBefore / all, (kColumnsBefore + work) / all)));
  state.solving_part = (2 * kColumnsBefore + work) / all;
}

MatrixFreeTransfer::~MatrixFreeTransfer() = default;

double MatrixFreeTransfer::solving_part() const {
  return state_->solving_part;
}

std::shared_ptr<const HierarchicalOperator> MatrixFreeTransfer::compress(
    const FittingLights& lights, double tolerance, const Progress& progress) const {
  const State& state = *state_;
  HierarchicalSettings settings = state.settings.compression;
  settings.tolerance = tolerance;
  const ThreadLimit limited(state.plan.thread_count);
  const BlockCheckpoint rounds(state.settings.checkpoint,
                               identity_of_rounds(state.panels_key, lights, settings));
  return compress_to_tolerance(*state.fine, state.patches, lights, settings, progress, rounds);
}

std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const MatrixFreeTransferSettings& settings,
    const Progress& progress) {
  const MatrixFreeTransfer transfer(form_factors, patches, lights, settings, progress);
  return transfer.compress(lights, settings.compression.tolerance,
                           part_of(progress, transfer.solving_part(), 1));
}

}  // namespace rebounce
