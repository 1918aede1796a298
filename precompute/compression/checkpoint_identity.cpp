#include "precompute/compression/checkpoint_identity.h"

#include <cstdint>
#include <string_view>
#include <vector>

#include "rebounce/version.h"
#include "transfer/file/content_hash.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {
namespace {

template <typename T>
void update(ContentHash& hash, std::span<const T> values) {
  const std::uint64_t count = values.size();
  hash.update(std::as_bytes(std::span(&count, 1)));
  hash.update(std::as_bytes(values));
}

}  // namespace

std::string identity_of_couplings(const HierarchicalOperator& form_factors,
                                  const PatchTable& patches, const FittingLights& lights,
                                  const PatchRoles& roles, std::span<const double> numbers) {
  ContentHash hash;
  update(hash, std::span(std::string_view(version())));
  update<int>(hash, {{kFileFormatVersion}});
  update(hash, numbers);
  const HierarchicalStorage& f = form_factors.storage();
  update(hash, std::span(f.blocks));
  update(hash, f.values_f32.span());
  update(hash, f.values_f16.span());
  update(hash, f.bases_q8.span());
  update(hash, f.packed_couplings.span());
  update<std::uint8_t>(hash, f.row_format);
  update<std::uint32_t>(hash, f.patch);
  update<float>(hash, patches.area);
  update<Float3>(hash, patches.centroid);
  update<Float3>(hash, patches.normal);
  update<Float3>(hash, patches.reflectance);
  update<std::uint8_t>(hash, roles.role);
  for (const std::vector<Float3>& light : lights.training) update<Float3>(hash, light);
  return hash.text();
}

std::string identity_of_rounds(const std::string& couplings, const FittingLights& lights,
                               const HierarchicalSettings& settings) {
  ContentHash hash;
  update(hash, std::span(std::string_view(couplings)));
  update(hash, std::span(&settings.tolerance, 1));
  update(hash, std::span(std::string_view(precision_name(settings.precision))));
  update<int>(hash, {{settings.cluster_bases}});
  for (const std::vector<Float3>& light : lights.validation) update<Float3>(hash, light);
  return hash.text();
}

}  // namespace rebounce
