#include "precompute/compression/hierarchical_transfer.h"

#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/tolerance_search.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

HierarchicalStorage compress_transfer(const DenseOperator& dense, const PatchTable& patches,
                                      std::span<const std::vector<Float3>> training,
                                      double multiplier, const Progress& progress,
                                      const PatchRoles& roles) {
  return compress_matrix(DenseMatrix(dense, roles), patches, training, multiplier, progress);
}

std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches, FittingLights lights,
    const HierarchicalSettings& settings, const Progress& progress, const PatchRoles& roles) {
  return compress_to_tolerance(DenseMatrix(dense, roles), patches, std::move(lights), settings,
                               progress);
}

}  // namespace rebounce
