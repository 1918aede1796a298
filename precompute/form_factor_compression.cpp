#include "rebounce/precompute/form_factor_compression.h"

#include "symmetric_matrix.h"

namespace rebounce {

std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches,
    std::span<const std::vector<Float3>> test_radiosities, const HierarchicalSettings& settings,
    const Progress& progress) {
  return compress_to_tolerance(FormFactorMatrix(exchange, patches.area), patches, test_radiosities,
                               settings, progress);
}

std::vector<std::vector<Float3>> radiosities_of(
    const TransferOperator& transfer, std::span<const Float3> reflectance,
    std::span<const std::vector<Float3>> initial_exitances) {
  std::vector<float> workspace(transfer.workspace_size());
  std::vector<Float3> indirect(reflectance.size());
  std::vector<std::vector<Float3>> radiosities;
  for (const std::vector<Float3>& m0 : initial_exitances) {
    transfer.apply(m0, indirect, workspace);
    std::vector<Float3>& radiosity = radiosities.emplace_back(m0);
    for (std::size_t i = 0; i < radiosity.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) radiosity[i][c] += reflectance[i][c] * indirect[i][c];
    }
  }
  return radiosities;
}

}  // namespace rebounce
