#pragma once

#include <cstdint>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {

/// Calls work(bases, cores, basis_values, core_values, basis_scale): the widest kernels for the
/// precision of an operator, its values, and what those of bases must be multiplied by.
template <typename Work>
auto with_kernels_of(const HierarchicalStorage& storage, const HierarchicalLayout& layout,
                     const Work& work) {
  const BlockKernels& blocks = kernels().blocks;
  const std::uint16_t* const f16 = storage.values_f16.data();
  const float* const f32 = storage.values_f32.data();
  const std::uint64_t first_core = layout.basis_value_count;
  switch (storage.precision) {
    case Precision::kF32:
      return work(blocks.bases_f32, blocks.cores_f32, f32, f32 + first_core, 1.0F);
    case Precision::kQ16:
      return work(blocks.bases_q16, blocks.cores_f16, storage.bases_q16.data(), f16,
                  HierarchicalFormat::kShortScale);
    case Precision::kQ8:
      return work(blocks.bases_q8, blocks.cores_f16, storage.bases_q8.data(), f16,
                  HierarchicalFormat::kByteScale);
    case Precision::kF16:
      break;
  }
  return work(blocks.bases_f16, blocks.cores_f16, f16, f16 + first_core, 1.0F);
}

/// What products of stored values must be multiplied by.
inline float product_scale(Precision precision) {
  constexpr float kHalfScale = HierarchicalFormat::kHalfScale;
  constexpr float kByteScale = HierarchicalFormat::kByteScale;
  constexpr float kShortScale = HierarchicalFormat::kShortScale;
  switch (precision) {
    case Precision::kF16:
      return 1 / kHalfScale;
    case Precision::kQ16:
      return 1 / (kHalfScale * kShortScale * kShortScale);
    case Precision::kQ8:
      return 1 / (kHalfScale * kByteScale * kByteScale);
    case Precision::kF32:
      break;
  }
  return 1;
}

}  // namespace rebounce
