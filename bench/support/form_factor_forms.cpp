#include "bench/support/form_factor_forms.h"

#include <fmt/format.h>

#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce::bench {
namespace {

/// F as a hierarchical operator that is only applied.
class SharedBasisFormFactors final : public FormFactorOperator {
 public:
  explicit SharedBasisFormFactors(std::shared_ptr<const HierarchicalOperator> exchange)
      : exchange_(std::move(exchange)) {}

  std::size_t patch_count() const override { return exchange_->patch_count(); }
  std::size_t bytes() const override { return exchange_->bytes(); }
  std::size_t bytes_per_gather() const override { return exchange_->bytes_per_apply(); }
  std::size_t workspace_size() const override { return exchange_->workspace_size(); }

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override {
    exchange_->apply(in, out, workspace, scheduler);
  }

  std::shared_ptr<const HierarchicalOperator> exchange_;
};

}  // namespace

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

std::string shared_name(double tolerance) {
  return "shared bases " + percent(tolerance);
}

Form shared_form(std::string name, std::shared_ptr<const HierarchicalOperator> compressed) {
  return {std::move(name), std::make_shared<const SharedBasisFormFactors>(std::move(compressed))};
}

bool can_sweep(const Form& form) {
  return dynamic_cast<const SweepableFormFactors*>(form.form_factors.get()) != nullptr;
}

}  // namespace rebounce::bench
