#include "raw_exchange.h"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "hemisphere_exchange.h"
#include "rebounce/transfer/error.h"
#include "row_targets.h"

namespace rebounce {
namespace {

// Deviations by which the count of hemisphere rays must be off to have a pair looked at again.
constexpr double kContradiction = 4;

class RawExchangeBuilder {
 public:
  RawExchangeBuilder(const PatchModel& model, const ShadowRays& shadow_rays,
                     const RayTracer& tracer, const FormFactorSettings& settings,
                     const Progress& progress)
      : model_(model),
        tracer_(tracer),
        settings_(settings),
        progress_(progress),
        patch_triangles_(model.mesh.triangle_patch, model.patches.size()),
        geometry_(shadow_rays.geometry()),
        shadow_rays_(shadow_rays) {}

  RawExchange run() {
    const std::size_t n = geometry_.patch_count();
    const std::vector<Escape> escape = trace_hemispheres();
    ExchangeRows rows(n);
    // Row i has n - i pairs: what is left is a triangle.
    const auto triangle = [](double done) { return 1 - (1 - done) * (1 - done); };
    for_each_patch([&](std::uint32_t i, Scratch& scratch) { compute_row(i, scratch, rows[i]); },
                   [&](double done) { return 0.2 + 0.6 * triangle(done); });
    const std::vector<RowTarget> target = row_targets(escape, settings_.hemisphere_rays);
    const std::vector<bool> doubtful =
        find_doubtful_rows(row_sums(rows, geometry_.areas()), target);
    for_each_patch(
        [&](std::uint32_t i, Scratch& scratch) { refine_row(i, doubtful, scratch, rows[i]); },
        [&](double done) { return 0.8 + 0.2 * triangle(done); });
    const std::uint64_t hemisphere_rays = n * static_cast<std::uint64_t>(settings_.hemisphere_rays);
    return {std::move(rows), escape, target, ray_count_ + hemisphere_rays, pair_count_};
  }

 private:
  struct Scratch {
    std::vector<FacingPatch> facing, mixed;
    std::vector<Ray> rays;
    std::vector<float> transmitted;  ///< of each ray
    EscapeScratch escape;
  };

  /// Runs `work` for every patch on all threads; throws Cancelled if asked to. `part` says which
  /// part of the whole is done when a part of the patches is.
  template <typename Work, typename Part>
  void for_each_patch(const Work& work, const Part& part) {
    const std::size_t n = geometry_.patch_count();
    std::atomic<bool> stop = false;
    std::atomic<std::size_t> rows_done = 0;
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 4)
      for (std::size_t i = 0; i < n; ++i) {
        if (stop) continue;
        work(static_cast<std::uint32_t>(i), scratch);
        const std::size_t done = ++rows_done;
        if (progress_ && omp_get_thread_num() == 0) {
          if (!progress_(part(static_cast<double>(done) / static_cast<double>(n)))) stop = true;
        }
      }
    }
    if (stop) throw Cancelled();
  }

  std::vector<Escape> trace_hemispheres() {
    const std::size_t n = geometry_.patch_count();
    std::vector<Escape> escape(n);
    std::vector<std::vector<MetPatch>> met(n);
    for_each_patch(
        [&](std::uint32_t i, Scratch& scratch) {
          escape[i] = measure_escape(model_, patch_triangles_[i], i, tracer_,
                                     settings_.hemisphere_rays, settings_.seed, scratch.escape);
          met[i] = count_met_patches(model_, scratch.escape.hits);
        },
        [](double done) { return 0.2 * done; });
    hemisphere_.emplace(met, geometry_.areas(), settings_.hemisphere_rays);
    return escape;
  }

  void compute_row(std::uint32_t i, Scratch& scratch, std::vector<ExchangeEntry>& row) {
    const auto is_fine = [&](std::uint32_t j) { return !is_coarse_pair(geometry_, i, j); };
    shadow_rays_.find_facing(i, scratch.facing, is_fine);
    trace(i, scratch.facing, settings_.probe_rays, scratch);
    scratch.mixed.clear();
    const auto probe = static_cast<std::size_t>(settings_.probe_rays);
    for (std::size_t p = 0; p < scratch.facing.size(); ++p) {
      const FacingPatch& pair = scratch.facing[p];
      const auto agreement =
          ShadowRays::agreement(std::span(scratch.rays).subspan(p * probe, probe),
                                std::span(scratch.transmitted).subspan(p * probe, probe));
      if (agreement == ShadowRays::Agreement::kMixed || is_contradicted(i, pair, agreement)) {
        scratch.mixed.push_back(pair);
      } else if (agreement == ShadowRays::Agreement::kClear) {
        append(row, pair, pair.unoccluded,
               kVisibilityVarianceFloor * pair.unoccluded * pair.unoccluded);
      }
    }
    append_mixed(i, scratch, row);
    append_coarse(i, row);
    std::ranges::sort(row, {}, &ExchangeEntry::column);
    pair_count_ += scratch.facing.size();
    ray_count_ += scratch.facing.size() * settings_.probe_rays;
  }

  /// True if hemisphere rays say otherwise than the few rays of a pair that agree.
  bool is_contradicted(std::uint32_t i, const FacingPatch& pair,
                       ShadowRays::Agreement agreement) const {
    const double count = hemisphere_->find(i, pair.patch).count;
    if (agreement == ShadowRays::Agreement::kHidden) return count > 0;
    const double expected = hemisphere_->expected_count(i, pair.patch, pair.unoccluded);
    return std::abs(count - expected) > kContradiction * std::sqrt(expected + 1);
  }

  /// Traces all rays of the pairs of row i that have a doubtful patch, and replaces their entries.
  void refine_row(std::uint32_t i, const std::vector<bool>& doubtful, Scratch& scratch,
                  std::vector<ExchangeEntry>& row) {
    const auto is_doubtful = [&](std::uint32_t j) {
      return (doubtful[i] || doubtful[j]) && !is_coarse_pair(geometry_, i, j);
    };
    std::erase_if(row, [&](const ExchangeEntry& entry) { return is_doubtful(entry.column); });
    shadow_rays_.find_facing(i, scratch.mixed, is_doubtful);
    append_mixed(i, scratch, row);
    std::ranges::sort(row, {}, &ExchangeEntry::column);
  }

  /// Traces all rays of scratch.mixed and adds what gets through to the row: the mean of what
  /// shadow rays and hemisphere rays say, weighted by the inverse of their variances.
  void append_mixed(std::uint32_t i, Scratch& scratch, std::vector<ExchangeEntry>& row) {
    const int full = settings_.full_rays;
    // No part is known better than that many rays tell (rule of succession).
    const double least_variance = 1.0 / ((full + 2.0) * (full + 2.0));
    trace(i, scratch.mixed, full, scratch);
    for (std::size_t p = 0; p < scratch.mixed.size(); ++p) {
      const FacingPatch& pair = scratch.mixed[p];
      const ShadowRays::Visibility visible =
          shadow_rays_.visibility(i, pair.patch, std::span(scratch.rays).subspan(p * full, full),
                                  std::span(scratch.transmitted).subspan(p * full, full));
      const double shadow = pair.unoccluded * visible.part;
      const double shadow_variance =
          pair.unoccluded * pair.unoccluded * std::max(visible.variance, least_variance);
      const double met = hemisphere_->find(i, pair.patch).exchange;
      const double met_variance = hemisphere_->variance(i, pair.patch, shadow);
      const double both = shadow_variance + met_variance;
      append(row, pair, (shadow * met_variance + met * shadow_variance) / both,
             shadow_variance * met_variance / both);
    }
    ray_count_ += scratch.mixed.size() * full;
  }

  /// Adds the near pairs of many triangles to row i, as hemisphere rays have them.
  void append_coarse(std::uint32_t i, std::vector<ExchangeEntry>& row) const {
    for (const HemisphereExchange::Pair& pair : hemisphere_->pairs(i)) {
      if (!is_coarse_pair(geometry_, i, pair.patch)) continue;
      append(row, {pair.patch, pair.exchange}, pair.exchange,
             hemisphere_->variance(i, pair.patch, pair.exchange));
    }
  }

  /// Traces `count` rays for each pair of patch i, one pair after the other.
  /// Where there are holes, a triangle's mean is all that patches resolve: taking it keeps the
  /// noise of single holes out of F.
  void trace(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
             Scratch& scratch) const {
    shadow_rays_.make_rays(i, facing, count, scratch.rays);
    scratch.transmitted.resize(scratch.rays.size());
    tracer_.transmittance(scratch.rays, PassageDetail::kTriangle, scratch.transmitted);
  }

  /// Adds a pair of so much `exchange`, m², of so much variance, m⁴.
  static void append(std::vector<ExchangeEntry>& row, const FacingPatch& pair, double exchange,
                     double variance) {
    if (static_cast<float>(exchange) <= 0) return;
    const double most = pair.unoccluded;
    row.push_back({pair.patch, static_cast<float>(exchange), static_cast<float>(most),
                   static_cast<float>(variance / (most * most))});
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  const Progress& progress_;
  const PatchTriangles patch_triangles_;
  const PatchGeometry& geometry_;
  const ShadowRays& shadow_rays_;
  std::optional<HemisphereExchange> hemisphere_;
  std::atomic<std::uint64_t> ray_count_ = 0, pair_count_ = 0;
};

}  // namespace

RawExchange compute_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                 const RayTracer& tracer, const FormFactorSettings& settings,
                                 const Progress& progress) {
  return RawExchangeBuilder(model, shadow_rays, tracer, settings, progress).run();
}

}  // namespace rebounce
