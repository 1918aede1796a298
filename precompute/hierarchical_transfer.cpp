#include "rebounce/precompute/hierarchical_transfer.h"

#include "matrix_compression.h"

namespace rebounce {

HierarchicalOperator::Storage compress_transfer(const DenseOperator& dense,
                                                const PatchTable& patches,
                                                std::span<const std::vector<Float3>> shaping,
                                                double price, const Progress& progress) {
  return compress_matrix(DenseMatrix(dense), patches, shaping, price, progress);
}

std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress) {
  return compress_to_tolerance(DenseMatrix(dense), patches, lights, settings, progress);
}

}  // namespace rebounce
