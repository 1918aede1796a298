#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rebounce/types.h"
#include "transfer/format/channel_lanes.h"
#include "transfer/format/operator_format.h"
#include "transfer/format/row_format.h"

namespace rebounce {

/// Vectors in planar order: vector v begins at v times `stride`. Each light has three, one per
/// channel.
template <typename T>
struct PlanarVectors {
  T* data;
  std::size_t stride, count;
};

/// Coefficients of light in bases, with neighbouring channels. Coefficient r of light l is at l
/// times `stride` + r times kChannelLanes; its last float is unused.
template <typename T>
struct Coefficients {
  T* data;
  std::size_t stride;
};

/// What is known of the light at a run of positions, to round it and to see where there is none.
struct LightRun {
  static constexpr std::size_t kPositions = HierarchicalFormat::kAlignment;

  /// By channel the largest magnitude; then the largest magnitude of what is negative.
  std::array<float, kChannelLanes> largest;
  std::array<float, kChannelLanes> sum;  ///< of the magnitudes, by channel
};

/// A range of ranks and positions of the bases over one cluster. Floats are [rank][size], integers
/// in the order of integer_kernels_impl.h. Sizes and positions are multiples of
/// HierarchicalFormat::kAlignment.
struct BasisPart {
  std::uint64_t values;                 ///< index of the first value of the cluster's bases
  std::uint32_t rank, size;             ///< of the whole cluster
  std::uint32_t coefficient, position;  ///< its first coefficient and position
  std::uint32_t first_rank, last_rank;  ///< the ranks [first, last)
  /// The positions [first, last), counted from the cluster's first.
  std::uint32_t first_offset, last_offset;
  /// Whether the bases are over cluster coefficients instead of positions. The integer kernels
  /// round these to 16 bits, whatever they are.
  bool over_cluster_coefficients = false;
};

/// Products with the bases of the hierarchical operator, for one instruction set. Stored integers
/// are used unscaled; the caller applies their scale.
template <typename Value>
struct BasisKernels {
  /// coefficient[r] = sum over k of basis[r][k] x[k], for the lights of x and the ranks of each
  /// part, over all positions of its cluster. With integers whole groups of
  /// HierarchicalFormat::kRankGroup ranks are written: coefficients of neighbouring ranks too.
  /// `runs` [lights][x.stride / LightRun::kPositions], from BlockKernels::measure_light, or null:
  /// then integer kernels measure the light themselves. Others do not look at it.
  void (*project)(const Value* values, std::span<const BasisPart> parts,
                  PlanarVectors<const float> x, const LightRun* runs,
                  Coefficients<float> coefficient);

  /// y[k] += sum over r of basis[r][k] coefficient[r], for the lights of y, part by part, with the
  /// ranks and positions of each part.
  void (*expand)(const Value* values, std::span<const BasisPart> parts,
                 Coefficients<const float> coefficient, PlanarVectors<float> y);
};

/// A coupling matrix S or a dense block, [rows][columns][matrix].
struct CouplingBlock {
  enum class Direction : std::uint8_t { kBoth, kToRows, kToColumns };

  std::uint64_t values;  ///< index of the first value; of a packed matrix, of the first byte
  std::uint32_t rows, columns;
  std::uint32_t row, column;  ///< first coefficients of its rows and columns
  Direction direction;
  /// Residual coefficients of its rows and columns. They follow the coefficients themselves
  /// (HierarchicalFormat::kResidualScale).
  std::uint32_t row_residual_rank = 0, column_residual_rank = 0;
  std::uint32_t first_row = kNotPacked;  ///< index of the RowFormat of the first row
};

/// The values of coupling matrices and dense blocks. Only operators with integer bases have packed
/// rows; their other values are in half precision.
template <typename Value>
struct CouplingValues {
  const Value* values;
  const std::uint8_t* packed = nullptr;      ///< readable up to 32 bytes beyond the last row
  const std::uint8_t* row_format = nullptr;  ///< RowFormat of each packed row
};

/// For each lane of a vector of four entries, which of the entry's values belongs to the lane's
/// channel.
struct ChannelLanes {
  ChannelLanes(const std::array<std::uint32_t, kChannelCount>& channel_matrix,
               std::uint32_t matrices);

  alignas(32) std::array<std::uint16_t,
                         16> value;  ///< of [entry][lane]; the last lane of an entry repeats blue
  std::size_t matrix_count;
};

/// out(row) = S in(column) and out(column) = S^T in(row), in the directions of each coupling
/// matrix, for each matrix and light in turn. Overwrites the output, also where `out` is `in`.
/// Input coefficients of residuals are added to the coefficients they belong to; output
/// coefficients of residuals are written too. Reads sixteen values from the beginning of each
/// entry, so the array must be padded. `scratch` has room for scratch_size() of each coupling
/// matrix.
template <typename Value>
using CouplingKernel = void (*)(const CouplingValues<Value>& values,
                                std::span<const CouplingBlock> couplings, const ChannelLanes& lanes,
                                std::size_t light_count, Coefficients<const float> in,
                                Coefficients<float> out, float* scratch);

/// A dense block of an operator with one matrix: [rows][columns], both multiples of
/// HierarchicalFormat::kAlignment.
struct DenseBlock {
  using Direction = CouplingBlock::Direction;

  std::uint64_t values;
  std::uint32_t rows, columns;
  std::uint32_t row_position, column_position;
  std::uint32_t row_out, column_out;  ///< first coefficients that the products overwrite
  Direction direction;
};

/// A range of positions at one end of a dense block: `count` of its `size` positions, from number
/// `first` on. The bases of a dense block are the identity.
struct DenseEnd {
  std::uint32_t position, count, coefficient;
  std::uint32_t first, size;
};

/// Products with coupling matrices and dense blocks, for one instruction set.
template <typename Value>
struct CouplingKernels {
  CouplingKernel<Value> multiply;

  /// out(row_out) = S x(column) and out(column_out) = S^T x(row), in the directions of each block,
  /// for each block and light in turn. Overwrites the output, which is [channel][rows] and
  /// [channel][columns], unlike coefficients.
  void (*multiply_dense)(const Value* values, std::span<const DenseBlock> blocks,
                         PlanarVectors<const float> x, Coefficients<float> out);

  /// y(position) += scale times the products of multiply_dense at each end, for each light of y.
  void (*add_products)(std::span<const DenseEnd> ends, Coefficients<const float> products,
                       float scale, PlanarVectors<float> y);

  /// y(row) += scale S x(column) and y(column) += scale S^T x(row) in the directions of each block,
  /// for one light.
  void (*add_dense)(const Value* values, std::span<const DenseBlock> blocks,
                    PlanarVectors<const float> x, float scale, PlanarVectors<float> y);
};

/// Products with the values of hierarchical operators, for one instruction set.
struct BlockKernels {
  BasisKernels<float> bases_f32;
  BasisKernels<std::uint16_t> bases_f16;
  BasisKernels<std::int8_t> bases_q8;
  CouplingKernels<float> couplings_f32;
  CouplingKernels<std::uint16_t> couplings_f16;
  /// Measures the runs of `count` positions of one light: three planes, `stride` floats apart.
  void (*measure_light)(const float* x, std::size_t stride, std::size_t count, LightRun* runs);
};

}  // namespace rebounce
