#include "precompute/compression/matrix_free_plan.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "precompute/compression/block_tree.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/patches/patch_selection.h"
#include "rebounce/error.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {
namespace {

// Of a patch and a matrix: bases, and couplings as in rooms; they hold at the default tolerance and
// grow with this power of 1 / tolerance (lab/114, lab/177).
constexpr double kOperatorBytes = 3.0e3, kRoomCouplings = 450, kOperatorGrowth = 0.4;

// Bytes of a coupling (pack_couplings), with what more vectors than in rooms take (lab/156).
constexpr double kCouplingBytes = 1.3;

// Of a patch: the lights, with their norms and what is tried of them (lab/177). Where the sky is
// open, lamps light fewer patches and fewer exchange light.
constexpr double kPatchBytes = kFittingLightBytes + 1200, kLessIfOpen = 0.6;

// What libraries take, and each thread but the first (lab/177).
constexpr std::size_t kLibraryBytes = 5'900'000, kThreadBytes = 4'000'000;

// An entry of a piece while it is compressed: in doubles, and as it was (lab/177).
constexpr std::size_t kPieceEntryBytes = sizeof(double) + sizeof(float);

// What lights take less of a patch while vectors are solved for than in the search (lab/177).
constexpr std::size_t kLessWhileSolving = 5000;

// Of a patch and a matrix while a dense operator is compressed, beside the lights: candidates of
// the search (lab/174).
constexpr std::size_t kSearchBytes = 1500;

/// Memory of threads that compress pieces of the operator, each its own.
std::size_t bytes_of_pieces(const MatrixFreeTransferSize& size, std::size_t threads) {
  const auto positions =
      static_cast<std::uint32_t>(HierarchicalFormat::position_count(size.patch_count));
  const std::size_t side = std::min(largest_piece(positions), positions);
  const std::size_t along = side > 0 ? (positions + side - 1) / side : 0;
  const std::size_t pieces = along * (along + 1) / 2;
  return std::min(threads, pieces) * side * side * size.matrix_count * kPieceEntryBytes;
}

/// Memory of threads that solve, beyond what the search takes anyway.
std::size_t bytes_of_solves(const MatrixFreeTransferSize& size, std::size_t threads) {
  constexpr std::size_t kVectors = 9;  // what is sent, those of the solver, coefficients
  constexpr std::size_t kOfThread = kVectors * SolvedTransfer::kBatchColumns * sizeof(float);
  return size.patch_count * (std::max(threads * kOfThread, kLessWhileSolving) - kLessWhileSolving);
}

}  // namespace

double mean_open_part(std::span<const float> sky_visibility) {
  const double sum = std::accumulate(sky_visibility.begin(), sky_visibility.end(), 0.0);
  return sky_visibility.empty() ? 0 : sum / static_cast<double>(sky_visibility.size());
}

MatrixFreeTransferPlan plan_matrix_free_transfer(const MatrixFreeTransferSize& size,
                                                 const MatrixFreeTransferSettings& settings) {
  constexpr std::size_t kGroupsOfThread = 4;  // of a run, so that all threads end together
  const auto patches = static_cast<double>(size.patch_count);
  const std::uint64_t limit = settings.memory_limit_bytes;
  const double rows = patches * static_cast<double>(size.matrix_count) *
                      wanted_part(settings.roles, size.patch_count) *
                      std::pow(kDefaultTolerance / settings.compression.tolerance, kOperatorGrowth);
  const double couplings =
      std::max(kRoomCouplings * rows, static_cast<double>(size.coupling_count));
  const double kept =
      (1 - kLessIfOpen * size.open_part) * (kPatchBytes * patches + kOperatorBytes * rows) +
      kCouplingBytes * couplings;

  MatrixFreeTransferPlan plan;
  for (plan.thread_count = omp_get_max_threads();; --plan.thread_count) {
    const auto threads = static_cast<std::size_t>(plan.thread_count);
    plan.cell_count = (kGroupsOfThread * threads + size.matrix_count - 1) / size.matrix_count;
    plan.peak_bytes = static_cast<std::size_t>(kept) + kLibraryBytes +
                      (threads - 1) * kThreadBytes +
                      std::max(bytes_of_pieces(size, threads), bytes_of_solves(size, threads));
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
