#include "precompute/compression/form_factor_compression.h"

#include <algorithm>
#include <utility>

#include "precompute/compression/tolerance_search.h"
#include "precompute/exchange/links/linked_matrix.h"
#include "precompute/inverse/patch_groups.h"
#include "precompute/lights/random_lights.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

/// Sweeps read the light at positions, so form factors have no cluster bases.
HierarchicalSettings without_cluster_bases(HierarchicalSettings settings) {
  settings.cluster_bases = false;
  return settings;
}

}  // namespace

std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches, FittingLights radiosities,
    const HierarchicalSettings& settings, const Progress& progress) {
  return compress_to_tolerance(FormFactorMatrix(exchange, patches.area), patches,
                               std::move(radiosities), without_cluster_bases(settings), progress);
}

std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    std::shared_ptr<const LinkedFormFactors> links, const PatchTable& patches,
    std::vector<std::uint8_t> group, FittingLights radiosities,
    const HierarchicalSettings& settings, const Progress& progress) {
  return compress_to_tolerance(LinkedMatrix(std::move(links), patches, std::move(group)), patches,
                               std::move(radiosities), without_cluster_bases(settings), progress);
}

std::vector<std::uint8_t> group_patches(std::shared_ptr<const LinkedFormFactors> links,
                                        const PatchTable& patches, const Progress& progress) {
  return group_patches(LinkedMatrix(std::move(links), patches), progress);
}

FormFactorError form_factor_error(const HierarchicalOperator& compressed,
                                  const FormFactorOperator& exact, const PatchTable& patches,
                                  std::span<const std::vector<Float3>> radiosities) {
  std::vector<float> workspace(std::max(compressed.workspace_size(), exact.workspace_size()));
  std::vector<Float3> truth(patches.size()), gathered(patches.size());
  std::vector<double> errors;
  for (const std::vector<Float3>& radiosity : radiosities) {
    exact.gather(radiosity, truth, workspace);
    if (arrives_nowhere(truth, radiosity, patches.area)) continue;
    compressed.apply(radiosity, gathered, workspace);
    errors.push_back(relative_difference(gathered, truth, patches.area));
  }
  FormFactorError result;
  result.light_count = static_cast<int>(errors.size());
  result.dark_count = static_cast<int>(radiosities.size() - errors.size());
  for (const double error : errors) {
    result.mean += error / static_cast<double>(errors.size());
    result.max = std::max(result.max, error);
  }
  return result;
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

FittingLights radiosities_of(const FittingLights& lights, const TransferData& data) {
  return {radiosities_of(*data.transfer, data.patches.reflectance, lights.training),
          radiosities_of(*data.transfer, data.patches.reflectance, lights.validation)};
}

}  // namespace rebounce
