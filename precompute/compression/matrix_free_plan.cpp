#include "precompute/compression/matrix_free_plan.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "precompute/compression/block_tree.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/patches/patch_selection.h"
#include "rebounce/error.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {
namespace {

// Bytes per patch, for each matrix, of bases and the rounds of the search, and couplings in rooms,
// as measured (lab/114, lab/156, lab/169). They hold at the default tolerance and grow with this
// power of 1 / tolerance.
constexpr double kOperatorBytes = 6.0e3, kRoomCouplings = 450, kOperatorGrowth = 0.4;

// Bytes of a coupling (pack_couplings), with what more vectors than in rooms take (lab/156).
constexpr double kCouplingBytes = 1.3;

// Of a patch and a matrix while a dense operator is compressed, beside the lights: candidates of
// the search (lab/174).
constexpr std::size_t kSearchBytes = 1500;

// Of OpenBLAS, for all threads but the first, each as far as its products fill it (lab/162,
// lab/173).
std::size_t blas_bytes(std::size_t patch_count, std::size_t thread_count) {
  constexpr std::size_t kOfPatch = 6'000, kMost = 12'000'000;
  return (thread_count - 1) * std::min(kMost, kOfPatch * patch_count);
}

// Of blocks that are at work while an operator is compressed (lab/114, lab/173).
std::size_t work_bytes(std::size_t patch_count) {
  constexpr std::size_t kOfPatch = 14'000, kMost = 8'000'000;
  return std::min(kMost, kOfPatch * patch_count);
}

}  // namespace

MatrixFreeTransferPlan plan_matrix_free_transfer(std::size_t patch_count, std::size_t matrix_count,
                                                 const MatrixFreeTransferSettings& settings,
                                                 std::uint64_t coupling_count) {
  constexpr std::size_t kGroupsOfThread = 4;  // of a run, so that all threads end together
  constexpr std::size_t kVectors = 9;         // what is sent, those of the solver, coefficients
  constexpr std::size_t kBatchColumns = SolvedTransfer::kBatchColumns;
  const std::size_t group = kVectors * patch_count * kBatchColumns * sizeof(float);
  const std::size_t side =
      largest_piece(static_cast<std::uint32_t>(HierarchicalFormat::position_count(patch_count)));
  // What is compressed of a piece is held in doubles too, but before the operator is whole
  // (lab/114).
  const std::size_t piece = side * side * matrix_count * sizeof(float);
  const std::uint64_t limit = settings.memory_limit_bytes;
  const double rows = static_cast<double>(patch_count * matrix_count) *
                      wanted_part(settings.roles, patch_count) *
                      std::pow(kDefaultTolerance / settings.compression.tolerance, kOperatorGrowth);
  const double couplings = std::max(kRoomCouplings * rows, static_cast<double>(coupling_count));
  const std::size_t kept =
      patch_count * kFittingLightBytes + work_bytes(patch_count) +
      static_cast<std::size_t>(kOperatorBytes * rows + kCouplingBytes * couplings);

  MatrixFreeTransferPlan plan;
  for (plan.thread_count = omp_get_max_threads();; --plan.thread_count) {
    const auto threads = static_cast<std::size_t>(plan.thread_count);
    plan.cell_count = (kGroupsOfThread * threads + matrix_count - 1) / matrix_count;
    plan.peak_bytes =
        std::max(threads * group, threads * piece) + blas_bytes(patch_count, threads) + kept;
    if (limit == 0 || plan.peak_bytes <= limit || threads == 1) return plan;
  }
}

std::uint64_t dense_compression_peak_bytes(std::size_t patch_count, std::size_t matrix_count) {
  // Blocks at work, each over all matrices: of a small operator, which is one piece, and of each
  // thread but the first with its share of OpenBLAS (lab/174).
  constexpr std::size_t kOfPiece = 9'500, kMostOfPiece = 4'800'000;
  constexpr std::size_t kOfThread = 2'500, kMostOfThread = 4'200'000;
  const auto others = static_cast<std::size_t>(omp_get_max_threads()) - 1;
  const std::size_t wide = 1 + matrix_count;
  const std::uint64_t triangle = static_cast<std::uint64_t>(patch_count) * patch_count / 2;
  return triangle * sizeof(float) * matrix_count +
         std::max(wide * std::min(kOfPiece * patch_count, kMostOfPiece),
                  patch_count * (kFittingLightBytes + kSearchBytes * matrix_count)) +
         others * wide * std::min(kOfThread * patch_count, kMostOfThread);
}

std::uint64_t form_factor_compression_bytes(std::size_t patch_count) {
  // Candidates of the search, up to as many entries as there are pairs (lab/167).
  constexpr std::size_t kOfPair = 7, kOfPatch = 14'700, kAtLeast = 53'000'000;
  const std::size_t candidates =
      std::min(kOfPair * patch_count * patch_count, kAtLeast + kOfPatch * patch_count);
  const auto threads = static_cast<std::size_t>(omp_get_max_threads());
  return kFittingLightBytes * patch_count + candidates + blas_bytes(patch_count, threads);
}

/// Throws Error if there is a memory limit and a plan does not fit into it.
void check_memory(std::size_t patch_count, const MatrixFreeTransferPlan& plan,
                  const MatrixFreeTransferSettings& settings) {
  const std::uint64_t limit = settings.memory_limit_bytes;
  if (limit == 0 || plan.peak_bytes <= limit) return;
  throw Error("an operator over " + std::to_string(patch_count) + " patches needs " +
              std::to_string(plan.peak_bytes >> 20) + " MiB at the least and may have " +
              std::to_string(limit >> 20) +
              " MiB; raise the memory limit or ask for fewer patches");
}

}  // namespace rebounce
