#include "precompute/facets/exchange_factors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "precompute/inverse/dense_transfer.h"
#include "rebounce/error.h"
#include "transfer/base/machine_memory.h"

namespace rebounce {
namespace {

// The inverse is that of patches, whose reflectance is at most 0.99.
constexpr double kLeastEmissivity = 0.01;

// Factors of other programs come in few digits: six after the point, or four that count.
constexpr double kFactorRounding = 1e-6, kRelativeRounding = 1e-3;

// What rows of such factors, or of those that were found apart, may add up to above 1.
constexpr double kMostOverOne = 0.02;

/// F(i, j); 0 if it is not stored.
double factor_of(const ViewFactors& factors, std::size_t i, std::uint32_t j) {
  const auto begin = factors.column.begin() + static_cast<std::ptrdiff_t>(factors.row_begin[i]);
  const auto end = factors.column.begin() + static_cast<std::ptrdiff_t>(factors.row_begin[i + 1]);
  const auto found = std::lower_bound(begin, end, j);
  if (found == end || *found != j) return 0;
  return factors.factor[static_cast<std::size_t>(found - factors.column.begin())];
}

[[noreturn]] void refuse_factor(std::size_t i, std::size_t j, const std::string& why) {
  throw Error("the view factor from facet " + std::to_string(i + 1) + " to facet " +
              std::to_string(j + 1) + " " + why);
}

/// Throws Error unless areas are above 0, factors and skies in [0, 1], rows with their sky at most
/// 1, and the two factors of a pair say the same: only one of them is used.
void check_factors(const ViewFactors& factors) {
  const std::vector<double>& area = factors.area;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (!(area[i] > 0) || !std::isfinite(area[i])) {
      throw Error("the area of facet " + std::to_string(i + 1) + " is not a number above 0");
    }
  }
  for (std::uint32_t i = 0; i < factors.size(); ++i) {
    double sum = factors.sky[i];
    if (!(sum >= 0))
      throw Error("the sky of facet " + std::to_string(i + 1) + " is not a number from 0 on");
    for (std::uint64_t k = factors.row_begin[i]; k < factors.row_begin[i + 1]; ++k) {
      const std::uint32_t j = factors.column[k];
      const double there = area[i] * factors.factor[k], back = area[j] * factor_of(factors, j, i);
      if (!(there >= 0) || !std::isfinite(there)) refuse_factor(i, j, "is not a number from 0 on");
      if (std::abs(there - back) > kRelativeRounding * std::max(there, back) +
                                       kFactorRounding * std::max(area[i], area[j])) {
        refuse_factor(i, j, "and the one back differ: times area they must be the same");
      }
      sum += factors.factor[k];
    }
    if (!(sum <= 1 + kMostOverOne)) {
      throw Error(fmt::format("the view factors and the sky of facet {} add up to {:.4g}, above 1",
                              i + 1, sum));
    }
  }
}

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

void check_exchange(std::size_t n, std::span<const double> emissivity) {
  if (emissivity.size() != n) {
    throw Error("there are " + std::to_string(emissivity.size()) + " emissivities for " +
                std::to_string(n) + " facets; give one number, or one for each facet");
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (emissivity[i] >= kLeastEmissivity && emissivity[i] <= 1) continue;
    throw Error("the emissivity of facet " + std::to_string(i + 1) + " is not in [0.01, 1]");
  }
  const std::uint64_t needed =
      dense_transfer_peak_bytes(n, 1, Arithmetic::kDouble) + std::uint64_t{n} * n * sizeof(float);
  if (needed > machine_memory_bytes()) {
    constexpr double kGiB = 1ULL << 30;
    throw Error(fmt::format(
        "exchange factors of {} facets need {:.3g} GiB, this machine has {:.3g}; take view factors "
        "alone, or fewer facets",
        n, static_cast<double>(needed) / kGiB, static_cast<double>(machine_memory_bytes()) / kGiB));
  }
}

ExchangeFactors compute_exchange_factors(const ViewFactors& factors,
                                         std::span<const double> emissivity,
                                         const Progress& progress) {
  const std::size_t n = factors.size();
  check_exchange(n, emissivity);
  check_factors(factors);
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
