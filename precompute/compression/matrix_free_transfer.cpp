#include "precompute/compression/matrix_free_transfer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "precompute/base/thread_limit.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/checkpoint_identity.h"
#include "precompute/compression/coupling_solver.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/sampled_bases.h"
#include "precompute/compression/tolerance_search.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/inverse/solved_matrix.h"
#include "precompute/inverse/solved_transfer.h"

namespace rebounce {
namespace {

// The residual of solved columns, as a fraction of the tolerance.
constexpr double kResidualPart = 0.35;  // lab/060: a smaller one changes no error

// The tolerance of the form factors that the steps multiply with, in tolerances of the operator.
constexpr double kCoarsePart = 8;  // lab/149

// The error that bases may leave, in tolerances of the operator.
constexpr double kBasisPart = 0.3;  // lab/132

// Only for progress: the work before the first sample, to find bases, and of the search, in vectors
// that are solved for (lab/132).
constexpr double kVectorsBefore = 7000, kVectorsOfBases = 5500, kVectorsOfRounds = 25000;

// Only for progress: the number of vectors for each matrix, before it is known (lab/132).
double usual_vectors(std::size_t patch_count) {
  return 13 * std::pow(static_cast<double>(patch_count), 0.57);
}

using TrainingLights = std::span<const std::vector<Float3>>;

/// Form factors as the steps of solves take them, with patches in the order of all form factors,
/// which is by `group`.
HierarchicalStorage coarser(const HierarchicalOperator& form_factors, const PatchTable& patches,
                            const std::vector<std::uint8_t>& group, TrainingLights training,
                            double tolerance) {
  return compress_matrix(HierarchicalMatrix(form_factors.storage(), group), patches, training,
                         initial_multiplier(kCoarsePart * tolerance, patches.size()));
}

/// The plan for `patches`. Throws Error if it does not fit into the memory limit.
MatrixFreeTransferPlan checked_plan(const PatchTable& patches,
                                    const MatrixFreeTransferSettings& settings,
                                    std::uint64_t couplings = 0) {
  const MatrixFreeTransferPlan plan =
      plan_matrix_free_transfer({.patch_count = patches.size(),
                                 .matrix_count = distinct_channels(patches.reflectance),
                                 .open_part = mean_open_part(patches.sky_visibility),
                                 .coupling_count = couplings},
                                settings);
  check_memory(patches.size(), plan, settings);
  return plan;
}

}  // namespace

struct MatrixFreeTransfer::State {
  State(const HierarchicalOperator& form_factors, const PatchTable& of_patches,
        TrainingLights training, MatrixFreeTransferSettings with)
      : settings(std::move(with)),
        patches(of_patches),
        plan(checked_plan(patches, settings)),
        limited(std::in_place, plan.thread_count),
        couplings_key(
            identity_of_couplings(form_factors, patches, training, settings,
                                  {{kBasisPart, kResidualPart, kCoarsePart, tolerance()}})),
        solved(form_factors, coarser(form_factors, patches, settings.group, training, tolerance()),
               patches, kResidualPart * tolerance()),
        matrix(solved, solved.estimated_energies(settings.roles), settings.roles, settings.group) {
    limited.reset();
  }

  double tolerance() const { return settings.compression.tolerance; }

  MatrixFreeTransferSettings settings;
  const PatchTable& patches;
  MatrixFreeTransferPlan plan;
  std::optional<ThreadLimit> limited;  ///< while the members below are made
  std::string couplings_key;
  SolvedTransfer solved;
  SolvedMatrix matrix;
  std::size_t solve_count = 0;
  double solving_part = 0;
};

MatrixFreeTransfer::MatrixFreeTransfer(const HierarchicalOperator& form_factors,
                                       const PatchTable& patches, TrainingLights training,
                                       const MatrixFreeTransferSettings& settings,
                                       const Progress& progress)
    : state_(std::make_unique<State>(form_factors, patches, training, settings)) {
  State& state = *state_;
  const ThreadLimit limited(state.plan.thread_count);
  const BlockCheckpoint checkpoint(settings.checkpoint, state.couplings_key);
  constexpr double kBefore = kVectorsBefore + kVectorsOfBases;
  const double usual =
      kBefore + state.solved.matrix_count() * usual_vectors(patches.size()) + kVectorsOfRounds;
  report_progress(progress, kVectorsBefore / usual);
  const CompressionFrame frame = compression_frame(state.matrix, patches, training);
  const std::vector<std::uint32_t> cells = clusters_up_to(frame.tree, kBasisCell);
  SharedBases bases = sample_bases(state.solved, frame, cells, kBasisPart * state.tolerance(),
                                   part_of(progress, kVectorsBefore / usual, kBefore / usual));
  const FramedCells framed{frame, cells};
  state.plan = checked_plan(patches, settings, coupling_count(bases, framed));
  const ThreadLimit limited_to_couplings(state.plan.thread_count);
  CouplingSolver solver(state.solved, bases, framed, state.plan.cell_count, checkpoint);
  const double begin = kBefore / usual, all = kBefore + solver.work() + kVectorsOfRounds;
  state.solving_part = std::max(begin, (kBefore + solver.work()) / all);
  state.solve_count = bases.sample_count + solver.solve_count();
  std::vector<PackedCouplings> couplings = solver.run(part_of(progress, begin, state.solving_part));
  state.matrix.set_entries(std::move(bases), std::move(couplings));
}

MatrixFreeTransfer::~MatrixFreeTransfer() = default;

const SolvedTransfer& MatrixFreeTransfer::solved() const {
  return state_->solved;
}

std::size_t MatrixFreeTransfer::solve_count() const {
  return state_->solve_count;
}

double MatrixFreeTransfer::solving_part() const {
  return state_->solving_part;
}

std::shared_ptr<const HierarchicalOperator> MatrixFreeTransfer::compress(
    FittingLights lights, double tolerance, const Progress& progress) const {
  const State& state = *state_;
  HierarchicalSettings settings = state.settings.compression;
  settings.tolerance = tolerance;
  const ThreadLimit limited(state.plan.thread_count);
  // Parts of a second search have the names of those of the first.
  std::filesystem::path folder = state.settings.checkpoint;
  if (!folder.empty() && tolerance != state.settings.compression.tolerance) folder /= "again";
  const BlockCheckpoint rounds(
      folder, identity_of_rounds(state.couplings_key, lights.validation, settings));
  return compress_to_tolerance(state.matrix, state.patches, std::move(lights), settings, progress,
                               rounds);
}

std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches, FittingLights lights,
    const MatrixFreeTransferSettings& settings, const Progress& progress) {
  const MatrixFreeTransfer transfer(form_factors, patches, lights.training, settings, progress);
  return transfer.compress(std::move(lights), settings.compression.tolerance,
                           part_of(progress, transfer.solving_part(), 1));
}

}  // namespace rebounce
