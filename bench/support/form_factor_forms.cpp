#include "bench/support/form_factor_forms.h"

#include <fmt/format.h>

#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce::bench {

std::string percent(double part) {
  return fmt::format("{:g} %", 100 * part);
}

std::string compressed_name(double tolerance) {
  return "compressed " + percent(tolerance);
}

std::vector<Form> exact_forms(const TransferData& data) {
  const std::vector<float>& area = data.patches.area;
  return {{kExactRows, std::make_shared<const FormFactorBlocks>(data.exchange, area)},
          {kExactHalf, std::make_shared<const ExchangeBlocks>(data.exchange, area)}};
}

Form links_form(const TransferData& data) {
  return {kLinks, std::make_shared<const LinkedFormFactors>(data.links, data.patches.area,
                                                            data.patches.centroid)};
}

Form compressed_form(std::string name, std::shared_ptr<const HierarchicalOperator> compressed) {
  return {std::move(name), std::make_shared<const CompressedFormFactors>(std::move(compressed))};
}

}  // namespace rebounce::bench
