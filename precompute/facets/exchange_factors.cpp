#include "precompute/facets/exchange_factors.h"

#include <string>

#include "precompute/inverse/dense_transfer.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// The inverse is that of patches, whose reflectance is at most 0.99.
constexpr double kLeastEmissivity = 0.01;

ExchangeMatrix exchange_of(const ViewFactors& factors) {
  std::vector<std::uint64_t> row_begin = {0};
  std::vector<std::uint32_t> column;
  std::vector<float> exchange_area;
  for (std::uint32_t i = 0; i < factors.size(); ++i) {
    for (std::uint64_t k = factors.row_begin[i]; k < factors.row_begin[i + 1]; ++k) {
      if (factors.column[k] < i) continue;
      column.push_back(factors.column[k]);
      exchange_area.push_back(static_cast<float>(factors.area[i] * factors.factor[k]));
    }
    row_begin.push_back(column.size());
  }
  return {SharedArray(std::move(row_begin)), SharedArray(std::move(column)),
          SharedArray(std::move(exchange_area))};
}

PatchTable patches_of(const ViewFactors& factors, std::span<const double> emissivity) {
  PatchTable patches;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto reflectance = static_cast<float>(1 - emissivity[i]);
    patches.area.push_back(static_cast<float>(factors.area[i]));
    patches.reflectance.push_back({reflectance, reflectance, reflectance});
  }
  return patches;
}

}  // namespace

ExchangeFactors compute_exchange_factors(const ViewFactors& factors,
                                         std::span<const double> emissivity,
                                         const Progress& progress) {
  const std::size_t n = factors.size();
  if (emissivity.size() != n) {
    throw Error("there are " + std::to_string(emissivity.size()) + " emissivities for " +
                std::to_string(n) + " facets; give one number, or one for each facet");
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (emissivity[i] >= kLeastEmissivity && emissivity[i] <= 1) continue;
    throw Error("the emissivity of facet " + std::to_string(i + 1) + " is not in [0.01, 1]");
  }
  const auto transfer = build_dense_transfer(exchange_of(factors), patches_of(factors, emissivity),
                                             Precision::kF32, progress);
  ExchangeFactors result{std::vector<float>(n * n), factors.sky};
  transfer->expand(0, result.factor);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      float& y = result.factor[i * n + j];
      result.sky[i] += y * (1 - emissivity[j]) * factors.sky[j];
      y *= static_cast<float>(emissivity[j]);
    }
  }
  return result;
}

}  // namespace rebounce
