#pragma once

// A scene with its form factors of all pairs and the dense operator, the truth for others.

#include <memory>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/inverse/dense_transfer.h"
#include "tests/support/test_scenes.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test {

/// The mean error of `transfer` under `lights` against `truth`: of the light of its sources at its
/// receivers.
inline double mean_error(const TransferOperator& transfer, const TransferOperator& truth,
                         std::span<const float> area, std::span<const std::vector<Float3>> lights) {
  double sum = 0;
  for (std::vector<Float3> light : lights) {
    transfer.roles().keep(PatchRoles::kSource, light);
    std::vector<Float3> exact = product(truth, light);
    transfer.roles().keep(PatchRoles::kReceiver, exact);
    sum += relative_difference(product(transfer, light), exact, area);
  }
  return sum / static_cast<double>(lights.size());
}

struct SolvedRoom {
  PatchTable patches;
  ExchangeMatrix exchange;
  std::shared_ptr<const DenseOperator> dense;

  SolvedRoom(const Scene& scene, std::size_t patch_count, Precision precision = Precision::kF32) {
    PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
    exchange =
        compute_form_factors(model, make_tracer(model), with_quality(FormFactorQuality::kLow))
            .exchange;
    patches = std::move(model.patches);
    dense = build_dense_transfer(exchange, patches, precision);
  }

  /// As the function above.
  double mean_error(const TransferOperator& transfer,
                    std::span<const std::vector<Float3>> lights) const {
    return test::mean_error(transfer, *dense, patches.area, lights);
  }
};

}  // namespace rebounce::test
