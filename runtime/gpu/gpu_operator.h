#pragma once

// A hierarchical operator as the compute shaders of this folder read it. Their comments say how
// their tables lie.

#include <array>
#include <cstdint>
#include <vector>

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Light is in slots: first the positions of patches, then cluster coefficients, then coefficients
/// in bases, one slot for each basis vector. Every slot has one scale, which its value is
/// multiplied with wherever it is computed. Each basis vector is in integers with a step of its
/// own: 8 bits where these hold it exactly, else 16.
struct GpuOperator {
  using Words2 = std::array<std::uint32_t, 2>;
  using Words4 = std::array<std::uint32_t, 4>;

  /// Positions that a work group writes; clusters begin and end at multiples of it.
  static constexpr std::uint32_t kStrip = HierarchicalFormat::kAlignment;
  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFF;

  /// How the entries of a block are stored. The shaders have these numbers too.
  enum class EntryFormat : std::uint32_t { kHalf, kFloat, kInteger };

  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  std::uint32_t position_count = 0;     ///< a multiple of kStrip
  std::uint32_t first_coefficient = 0;  ///< the slot of the first coefficient in a basis
  std::vector<Words2> positions;        ///< patch or kNoPatch, bits of the weight of its light
  std::vector<float> scales;            ///< [slots]
  std::vector<std::uint32_t> bases;
  /// Entries of coupling matrices and dense blocks, as they are stored: floats, or pairs of halves
  /// or of the integers of packed rows, whose steps are in the scales of the rows' slots.
  std::vector<std::uint32_t> couplings;
  /// Items of two entries; those over positions first.
  std::vector<Words4> projections;
  std::uint32_t position_projections = 0;  ///< items
  std::vector<Words4> sides;               ///< of coupling matrices, two entries each
  std::vector<Words2> outputs;             ///< one for each coefficient: side, and place in it
  std::vector<std::uint32_t> inputs;       ///< slots
  std::vector<Words4> strips;              ///< of positions, then of cluster coefficients
  std::vector<Words4> strip_entries;

  std::uint32_t strip_count() const { return static_cast<std::uint32_t>(strips.size()); }
  std::uint32_t position_strips() const { return position_count / kStrip; }
};

/// Turns an operator into tables. It takes memory for its values in f32 for the time of the call.
/// Throws Error if it is too large for indices of 32 bits.
GpuOperator make_gpu_operator(const HierarchicalStorage& storage);

}  // namespace rebounce
