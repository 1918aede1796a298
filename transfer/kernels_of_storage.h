#pragma once

#include <cstdint>

#include "block_kernels.h"
#include "hierarchical_layout.h"

namespace rebounce {

/// Calls work(bases, cores, basis_values, core_values, basis_scale): the widest kernels for the
/// precision of an operator, its values, and what those of bases must be multiplied by.
template <typename Work>
auto with_kernels_of(const HierarchicalOperator::Storage& storage, const HierarchicalLayout& layout,
                     const Work& work) {
  const BlockKernelSet& kernels = block_kernels();
  const std::uint16_t* const f16 = storage.values_f16.data();
  const float* const f32 = storage.values_f32.data();
  const std::uint64_t first_core = layout.basis_value_count;
  switch (storage.precision) {
    case Precision::kF32:
      return work(kernels.bases_f32, kernels.cores_f32, f32, f32 + first_core, 1.0F);
    case Precision::kQ16:
      return work(kernels.bases_q16, kernels.cores_f16, storage.bases_q16.data(), f16,
                  HierarchicalOperator::kShortScale);
    case Precision::kQ8:
      return work(kernels.bases_q8, kernels.cores_f16, storage.bases_q8.data(), f16,
                  HierarchicalOperator::kByteScale);
    case Precision::kF16:
      break;
  }
  return work(kernels.bases_f16, kernels.cores_f16, f16, f16 + first_core, 1.0F);
}

}  // namespace rebounce
