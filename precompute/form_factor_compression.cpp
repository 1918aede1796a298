#include "rebounce/precompute/form_factor_compression.h"

#include <algorithm>

#include "linked_matrix.h"
#include "matrix_compression.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/reflection.h"

namespace rebounce {

std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches, const FittingLights& radiosities,
    const HierarchicalSettings& settings, const Progress& progress) {
  return compress_to_tolerance(FormFactorMatrix(exchange, patches.area), patches, radiosities,
                               settings, progress);
}

std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const FormFactorLinks& links, const PatchTable& patches, const FittingLights& radiosities,
    const HierarchicalSettings& settings, const Progress& progress) {
  return compress_to_tolerance(LinkedMatrix(links, patches), patches, radiosities, settings,
                               progress);
}

FormFactorError form_factor_error(const HierarchicalOperator& compressed,
                                  const FormFactorOperator& exact, const PatchTable& patches,
                                  std::span<const std::vector<Float3>> radiosities) {
  std::vector<float> workspace(std::max(compressed.workspace_size(), exact.workspace_size()));
  std::vector<Float3> truth(patches.size()), gathered(patches.size());
  FormFactorError error;
  for (const std::vector<Float3>& radiosity : radiosities) {
    exact.gather(radiosity, truth, workspace);
    compressed.apply(radiosity, gathered, workspace);
    const double e = relative_difference(gathered, truth, patches.area);
    error.mean += e / static_cast<double>(radiosities.size());
    error.max = std::max(error.max, e);
  }
  return error;
}

std::vector<std::vector<Float3>> radiosities_of(
    const TransferOperator& transfer, std::span<const Float3> reflectance,
    std::span<const std::vector<Float3>> initial_exitances) {
  std::vector<float> workspace(transfer.workspace_size());
  std::vector<Float3> indirect(reflectance.size());
  std::vector<std::vector<Float3>> radiosities;
  for (const std::vector<Float3>& m0 : initial_exitances) {
    transfer.apply(m0, indirect, workspace);
    add_reflected(m0, reflectance, indirect, radiosities.emplace_back(m0.size()));
  }
  return radiosities;
}

DrawnLights radiosities_of(const DrawnLights& lights, const TransferData& data) {
  return {radiosities_of(*data.transfer, data.patches.reflectance, lights.shaping),
          radiosities_of(*data.transfer, data.patches.reflectance, lights.judging)};
}

}  // namespace rebounce
