#include "bench/exchange_reference.h"

#include <algorithm>
#include <cmath>

#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce::bench {
namespace {

constexpr std::uint64_t kFirstSeed = 1000;  // far from those that are under test
constexpr double kKernelTolerance = 1e-6;
constexpr int kRays = static_cast<int>(ShadowRays::kMostRays);  // of a pair and round

/// What all rounds found out about one pair, i <= j.
struct PooledPair {
  std::uint32_t patch;
  double unoccluded;
  VisibilityEstimate estimate;
  std::uint64_t hemisphere_count = 0;

  bool is_settled() const {
    if (estimate.is_empty()) return false;
    if (estimate.part() == 0) return hemisphere_count == 0;
    return estimate.part() == 1;
  }
};

class ReferenceBuilder {
 public:
  ReferenceBuilder(const PatchModel& model, const RayTracer& tracer,
                   const std::vector<double>& radiosity, int factor)
      : model_(model),
        tracer_(tracer),
        radiosity_(radiosity),
        factor_(factor + factor % 2),  // two halves of as many rounds
        n_(model.patches.size()),
        patch_triangles_(model.mesh.triangle_patch, n_),
        rays_each_(FormFactorSettings().hemisphere_rays) {}

  ExchangeReference run() {
    trace_hemispheres();
    trace_pairs();
    const double noise = gather_noise();
    return {std::move(exchange_area_), std::move(gathered_), noise};
  }

 private:
  void trace_hemispheres() {
    count_.assign(n_ * n_, 0);
    half_.assign(2, std::vector<double>(n_, 0.0));
#pragma omp parallel
    {
      EscapeScratch scratch;
      MetPatchCounter counter;
#pragma omp for schedule(dynamic, 4)
      for (std::uint32_t i = 0; i < n_; ++i) {
        for (int round = 0; round < factor_; ++round) {
          measure_escape(model_, patch_triangles_[i], i, tracer_, rays_each_, kFirstSeed + round,
                         scratch);
          for (const MetPatch& met : counter.count(n_, scratch.met)) {
            count_[i * n_ + met.patch] += met.count;
            half_[round % 2][i] += met.count * radiosity_[met.patch];
          }
        }
      }
    }
    gathered_.resize(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      gathered_[i] = (half_[0][i] + half_[1][i]) / (static_cast<double>(rays_each_) * factor_);
    }
  }

  /// Half the difference of the halves deviates as much as their mean does.
  double gather_noise() const {
    const double rays = static_cast<double>(rays_each_) * factor_;
    double noise = 0, norm = 0;
    for (std::size_t i = 0; i < n_; ++i) {
      const double area = model_.patches.area[i];
      noise += area * std::pow((half_[0][i] - half_[1][i]) / rays, 2);
      norm += area * gathered_[i] * gathered_[i];
    }
    return std::sqrt(noise / norm);
  }

  double hemisphere_exchange(std::size_t i, std::size_t j) const {
    const double a = model_.patches.area[i], b = model_.patches.area[j];
    const double count = static_cast<double>(count_[i * n_ + j]) + count_[j * n_ + i];
    return count * a * b / ((a + b) * rays_each_ * factor_);
  }

  void trace_pairs() {
    std::vector<std::vector<PooledPair>> rows(n_);
    const int rounds = std::max(1, factor_ * FormFactorSettings().full_rays / kRays);
    const PatchGeometry geometry(model_, tracer_);
    for (int round = 0; round < rounds; ++round) {
      const ShadowRays shadow_rays(geometry, kFirstSeed + round, kKernelTolerance);
#pragma omp parallel for schedule(dynamic, 4)
      for (std::uint32_t i = 0; i < n_; ++i) {
        if (round == 0) rows[i] = facing_pairs(shadow_rays, i);
        trace_row(shadow_rays, i, rows[i]);
      }
    }
    fill(geometry, rows);
  }

  std::vector<PooledPair> facing_pairs(const ShadowRays& shadow_rays, std::uint32_t i) const {
    std::vector<FacingPatch> facing;
    shadow_rays.find_facing(
        i, facing, [&](std::uint32_t j) { return !is_coarse_pair(shadow_rays.geometry(), i, j); });
    std::vector<PooledPair> row;
    row.reserve(facing.size());
    for (const FacingPatch& pair : facing) {
      const std::uint64_t count = count_[i * n_ + pair.patch] + count_[pair.patch * n_ + i];
      row.push_back({pair.patch, pair.unoccluded, {}, count});
    }
    return row;
  }

  void trace_row(const ShadowRays& shadow_rays, std::uint32_t i,
                 std::vector<PooledPair>& row) const {
    std::vector<Ray> rays;
    std::vector<float> transmitted(kRays);
    for (PooledPair& pair : row) {
      if (pair.is_settled()) continue;
      shadow_rays.make_rays(i, {{pair.patch, pair.unoccluded}}, kRays, rays);
      tracer_.transmittance(rays, PassageDetail::kTriangle, transmitted);
      ShadowRays::add(rays, transmitted, pair.estimate);
    }
  }

  void fill(const PatchGeometry& geometry, const std::vector<std::vector<PooledPair>>& rows) {
    exchange_area_.assign(n_ * n_, 0.0);
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t j = i; j < n_; ++j) {
        if (is_coarse_pair(geometry, i, j)) set(i, j, hemisphere_exchange(i, j));
      }
      for (const PooledPair& pair : rows[i]) {
        const double part = pair.estimate.is_empty() ? 0 : pair.estimate.part();
        if (is_near_pair(geometry, i, pair.patch) && !pair.is_settled()) {
          set(i, pair.patch, hemisphere_exchange(i, pair.patch));
          continue;
        }
        set(i, pair.patch, pair.unoccluded * part);
      }
    }
  }

  void set(std::size_t i, std::size_t j, double exchange) {
    exchange_area_[i * n_ + j] = exchange_area_[j * n_ + i] = exchange;
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const std::vector<double>& radiosity_;
  int factor_;
  std::size_t n_;
  PatchTriangles patch_triangles_;
  int rays_each_;
  std::vector<std::uint32_t> count_;       ///< [n][n] hemisphere rays from one to the other
  std::vector<std::vector<double>> half_;  ///< [2][n] sums of radiosity over even and odd rounds
  std::vector<double> gathered_, exchange_area_;
};

}  // namespace

ExchangeReference make_exchange_reference(const PatchModel& model, const RayTracer& tracer,
                                          const std::vector<double>& radiosity, int factor) {
  return ReferenceBuilder(model, tracer, radiosity, factor).run();
}

}  // namespace rebounce::bench
