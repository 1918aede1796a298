#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "transfer/base/types.h"
#include "transfer/format/channel_lanes.h"

namespace rebounce {

/// Vectors that are worked on together, planar: vector v begins at v times `stride`. Three for each
/// light, its channels.
template <typename T>
struct PlanarVectors {
  T* data;
  std::size_t stride, count;
};

/// Coefficients of light in bases, its channels side by side: coefficient r of light l is the
/// kChannelLanes floats from l times `stride` + r times kChannelLanes, of which the last is not
/// used.
template <typename T>
struct Coefficients {
  T* data;
  std::size_t stride;
};

/// Ranks and positions of the bases over a cluster, [rank][size]; integers in the order of
/// integer_kernels_impl.h. Sizes and positions are multiples of
/// HierarchicalFormat::kAlignment.
struct BasisPart {
  std::uint64_t values;                   ///< where the bases of the cluster begin
  std::uint32_t rank, size;               ///< of the cluster
  std::uint32_t coefficient, position;    ///< its first ones
  std::uint32_t first_rank, last_rank;    ///< [first, last) of them
  std::uint32_t first_place, last_place;  ///< positions in the cluster, likewise
  /// Whether the positions are cluster coefficients: none is bright for what faces nothing, as they
  /// are what arrives of the light.
  bool cluster_coefficients = false;
};

/// Products with the bases of the hierarchical operator, for one instruction set. Integers stand
/// for themselves: their scale is elsewhere.
template <typename Value>
struct BasisKernels {
  /// coefficient[r] = sum over k of basis[r][k] x[k] for the lights of x and the ranks of each
  /// part, over all positions of its cluster. Of integers, ranks begin with a multiple of
  /// HierarchicalFormat::kRankGroup, and coefficients are written up to the next one.
  void (*project)(const Value* values, std::span<const BasisPart> parts,
                  PlanarVectors<const float> x, Coefficients<float> coefficient);

  /// y[k] += sum over r of basis[r][k] coefficient[r] for the lights of y, the ranks and the
  /// positions of one part after the other.
  void (*expand)(const Value* values, std::span<const BasisPart> parts,
                 Coefficients<const float> coefficient, PlanarVectors<float> y);
};

/// A coupling matrix S or a dense block, [rows][columns][matrix].
struct CouplingBlock {
  enum class Direction : std::uint8_t { kBoth, kToRows, kToColumns };

  std::uint64_t values;
  std::uint32_t rows, columns;
  std::uint32_t row, column;  ///< first coefficients at its ends
  Direction direction;
  /// Of the coefficients at its ends, those of residuals, after its own
  /// (HierarchicalFormat::kResidualScale).
  std::uint32_t row_residual_rank = 0, column_residual_rank = 0;
};

/// What serves the channels of an entry of kMatrices neighbouring values: lanes of four entries.
struct ChannelLanes {
  ChannelLanes(const std::array<std::uint32_t, kChannelCount>& channel_matrix,
               std::uint32_t matrices);

  alignas(32) std::array<std::uint16_t, 16> value;  ///< of [entry][lane]; the last lane is blue's
  std::size_t matrix_count;
};

/// out(row) = S in(column) and out(column) = S^T in(row), as its direction says, for one coupling
/// matrix after the other and each light; what was there before is overwritten, also where `out` is
/// `in`. Coefficients of residuals are added to those that they belong to; those that come out are
/// written too. Sixteen values are read from the beginning of each entry. `taken` has room for
/// taken_size() of each coupling matrix.
template <typename Value>
using CouplingKernel = void (*)(const Value* values, std::span<const CouplingBlock> couplings,
                                const ChannelLanes& lanes, std::size_t light_count,
                                Coefficients<const float> in, Coefficients<float> out,
                                float* taken);

/// A dense block of the only matrix of an operator, [rows][columns], both multiples of
/// HierarchicalFormat::kAlignment.
struct DenseBlock {
  using Direction = CouplingBlock::Direction;

  std::uint64_t values;
  std::uint32_t rows, columns;
  std::uint32_t row_position, column_position;
  std::uint32_t row_out, column_out;  ///< coefficients in whose places the products are put
  Direction direction;
};

/// Positions at an end of a dense block, whose bases are the identity: `count` of the `size` that
/// it has, from `first` on.
struct DenseEnd {
  std::uint32_t position, count, coefficient;
  std::uint32_t first, size;
};

/// Products with coupling matrices and dense blocks, for one instruction set.
template <typename Value>
struct CouplingKernels {
  CouplingKernel<Value> multiply;

  /// out(row_out) = S x(column) and out(column_out) = S^T x(row), as its direction says, for one
  /// block after the other and each light of x; what was there before is overwritten. Unlike
  /// coefficients they are [channel][rows] and [channel][columns].
  void (*multiply_dense)(const Value* values, std::span<const DenseBlock> blocks,
                         PlanarVectors<const float> x, Coefficients<float> out);

  /// y(position) += scale times what multiply_dense has put at each end, for each light of y.
  void (*add_products)(std::span<const DenseEnd> ends, Coefficients<const float> products,
                       float scale, PlanarVectors<float> y);

  /// y(row) += scale S x(column) and y(column) += scale S^T x(row) likewise, of one light.
  void (*add_dense)(const Value* values, std::span<const DenseBlock> blocks,
                    PlanarVectors<const float> x, float scale, PlanarVectors<float> y);
};

/// Products with the values of hierarchical operators, for one instruction set.
struct BlockKernels {
  BasisKernels<float> bases_f32;
  BasisKernels<std::uint16_t> bases_f16;
  BasisKernels<std::int16_t> bases_q16;
  BasisKernels<std::int8_t> bases_q8;
  CouplingKernels<float> couplings_f32;
  CouplingKernels<std::uint16_t> couplings_f16;
};

}  // namespace rebounce
