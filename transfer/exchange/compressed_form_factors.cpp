
#include "transfer/exchange/compressed_form_factors.h"
#include "rebounce/error.h"
#include "transfer/exchange/cluster_relaxation.h"

namespace rebounce {

CompressedFormFactors::CompressedFormFactors(std::shared_ptr<const HierarchicalOperator> exchange)
    : exchange_(std::move(exchange)) {
  if (!exchange_) throw Error("compressed form factors: there are none");
  if (exchange_->storage().matrix_count != 1) {
    throw Error("compressed form factors: the channels have different matrices");
  }
  if (!exchange_->storage().coefficient_scale.empty()) {
    throw Error(
        "compressed form factors: their bases are nested, and sweeps need bases that are not");
  }
}

void CompressedFormFactors::do_gather(std::span<const Float3> in, std::span<Float3> out,
                                      std::span<float> workspace,
                                      const Scheduler& scheduler) const {
  exchange_->apply(in, out, workspace, scheduler);
}

std::unique_ptr<Relaxation> CompressedFormFactors::make_relaxation() const {
  return make_cluster_relaxation(exchange_->storage());
}

}  // namespace rebounce
