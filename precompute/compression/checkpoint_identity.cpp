#include "precompute/compression/checkpoint_identity.h"

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "precompute/base/identity.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {
namespace {

// The layout of the couplings of a cell in a checkpoint; another number for each.
constexpr std::uint32_t kCouplingLayout = 1;

}  // namespace

std::string identity_of_couplings(const HierarchicalOperator& form_factors,
                                  const PatchTable& patches,
                                  std::span<const std::vector<Float3>> training,
                                  const MatrixFreeTransferSettings& settings,
                                  std::span<const double> numbers) {
  Identity identity;
  const HierarchicalStorage& f = form_factors.storage();
  identity.add(std::span(&kCouplingLayout, 1), numbers, f.blocks, f.values_f32.span(),
               f.values_f16.span(), f.bases_q8.span(), f.packed_couplings.span(), f.row_format,
               f.patch);
  identity.add(patches.area, patches.centroid, patches.normal, patches.reflectance,
               settings.roles.role, settings.group);
  for (const std::vector<Float3>& light : training) identity.add(light);
  return identity.text();
}

std::string identity_of_rounds(const std::string& couplings,
                               std::span<const std::vector<Float3>> validation,
                               const HierarchicalSettings& settings) {
  Identity identity;
  identity.add(couplings, std::string_view(precision_name(settings.precision)),
               std::array{settings.tolerance, settings.largest_over_mean},
               std::array{settings.cluster_bases});
  for (const std::vector<Float3>& light : validation) identity.add(light);
  return identity.text();
}

}  // namespace rebounce
