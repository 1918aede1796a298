#include "precompute/exchange/pairs/raw_exchange.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>

#include "precompute/base/parallel_progress.h"
#include "precompute/exchange/pairs/adaptive_row_sampling.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/row_sum_targets.h"

namespace rebounce {
namespace {

// Deviations by which the count of hemisphere rays must be off before a clear pair is examined
// again, and before the count overrules all rays of the pair.
constexpr double kDoubt = 2, kContradiction = 4;

// A large pair exchanges more than this fraction of the light of either patch (lab/011).
constexpr double kLargePart = 3e-4;

// The variance of points of Sobol's sequence as a fraction of that of random ones; over
// partly hidden pairs it is 0.14 to 0.19 (lab/004).
constexpr double kSpreadGain = 0.2;

// A row is traced again with this multiple of the probe rays if its sum is off its target by more
// than the tolerance (and three deviations), for settings with at least the default number of rays:
// probe rays miss some partly covered pairs (lab/005).
constexpr double kRowSumTolerance = 6e-4;
constexpr int kDefaultRays = 64, kRefinedProbes = 4;

// A forecast samples one of kForecastShare patches, within these limits, in runs of neighbours,
// whose rays meet similar surfaces.
constexpr std::size_t kForecastShare = 32, kForecastLeast = 64, kForecastMost = 512;
constexpr std::size_t kForecastRun = 16;

std::vector<std::uint32_t> sample_of_patches(std::size_t patch_count) {
  const std::size_t wanted =
      std::clamp(patch_count / kForecastShare, kForecastLeast, kForecastMost);
  const std::size_t runs = std::min(wanted / kForecastRun, patch_count);
  const std::size_t length = std::min(patch_count / runs, kForecastRun);
  std::vector<std::uint32_t> sample;
  for (std::size_t run = 0; run < runs; ++run) {
    const std::size_t begin = (2 * run + 1) * patch_count / (2 * runs) - length / 2;
    for (std::size_t k = 0; k < length; ++k)
      sample.push_back(static_cast<std::uint32_t>(begin + k));
  }
  return sample;
}

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
    std::vector<std::uint32_t> all(n);
    std::iota(all.begin(), all.end(), 0U);
    const std::vector<Escape> escape =
        trace_hemispheres(all, [](double done) { return 0.2 * done; });
    ExchangeRows rows(n);
    // Row i has n - i pairs: the rest of the work is a triangle.
    const auto triangle = [](double done) { return 1 - (1 - done) * (1 - done); };
    const auto every = [](std::uint32_t) { return true; };
    for_each_patch(
        all, [&](std::uint32_t i, Scratch& scratch) { compute_row(i, every, scratch, rows[i]); },
        [&](double done) { return 0.2 + 0.6 * triangle(done); });
    const std::vector<RowSumTarget> target = row_sum_targets(escape, settings_.hemisphere_rays);
    const AdaptiveRowSampling look(row_sums(rows, geometry_.areas()), target, row_sum_tolerance());
    const auto refine = [&](const std::vector<bool>& doubtful, double begin) {
      for_each_patch(
          all,
          [&](std::uint32_t i, Scratch& scratch) { refine_row(i, doubtful, scratch, rows[i]); },
          [&](double done) { return begin + 0.1 * triangle(done); });
    };
    refine(look.trial(), 0.8);
    const std::vector<bool> rest = look.rest(row_sums(rows, geometry_.areas()));
    if (!rest.empty()) refine(rest, 0.9);
    return {std::move(rows), escape, target, ray_count_ + hemisphere_ray_count(n), pair_count_};
  }

  /// Forecasts from the pairs of some patches with each other.
  FormFactorForecast forecast() {
    const std::size_t n = geometry_.patch_count();
    const std::vector<std::uint32_t> sample = sample_of_patches(n);
    std::vector<bool> sampled(n);
    for (const std::uint32_t i : sample) sampled[i] = true;
    const auto wanted = [&](std::uint32_t j) { return sampled[j]; };
    const auto begin = Clock::now();
    trace_hemispheres(sample, [](double done) { return 0.5 * done; });
    const auto between = Clock::now();
    for_each_patch(
        sample,
        [&](std::uint32_t i, Scratch& scratch) {
          std::vector<ExchangeEntry> row;
          compute_row(i, wanted, scratch, row);
        },
        [](double done) { return 0.5 + 0.5 * done; });
    const std::chrono::duration<double> hemispheres = between - begin,
                                        pairs = Clock::now() - between;
    const double share = static_cast<double>(n) / static_cast<double>(sample.size());
    return {hemispheres.count() * share + pairs.count() * share * share,
            static_cast<double>(hemisphere_ray_count(n)) +
                static_cast<double>(ray_count_) * share * share};
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Scratch {
    std::vector<FacingPatch> facing, mixed, large_mixed;
    std::vector<Ray> rays;
    std::vector<float> transmitted;  ///< by ray
    EscapeScratch escape;
    MetPatchCounter counter;
  };

  std::uint64_t hemisphere_ray_count(std::size_t patch_count) const {
    return patch_count * static_cast<std::uint64_t>(settings_.hemisphere_rays);
  }

  /// Runs `work` for every one of `patches` on all threads; throws Cancelled if asked to stop.
  /// `part` maps the fraction of these patches that is done to the fraction of the whole.
  template <typename Work, typename Part>
  void for_each_patch(std::span<const std::uint32_t> patches, const Work& work, const Part& part) {
    const Progress whole = [&](double done) { return !progress_ || progress_(part(done)); };
    ParallelProgress loop(whole, patches.size());
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 4)
      for (std::size_t k = 0; k < patches.size(); ++k) {
        if (loop.stopped()) continue;
        work(patches[k], scratch);
        loop.advance();
      }
    }
    loop.finish();
  }

  /// Measures the escape of `patches`; for others nothing is known afterwards.
  template <typename Part>
  std::vector<Escape> trace_hemispheres(std::span<const std::uint32_t> patches, const Part& part) {
    const std::size_t n = geometry_.patch_count();
    std::vector<Escape> escape(n);
    std::vector<std::vector<MetPatch>> met(n);
    for_each_patch(
        patches,
        [&](std::uint32_t i, Scratch& scratch) {
          escape[i] =
              measure_escape(model_.mesh, model_.shown_patch, patch_triangles_[i], i, tracer_,
                             settings_.hemisphere_rays, settings_.seed, scratch.escape);
          met[i] = scratch.counter.count(n, scratch.escape.met);
        },
        part);
    hemisphere_.emplace(met, geometry_.areas(), settings_.hemisphere_rays);
    return escape;
  }

  /// The pairs (i, j) that are not coarse and have `wanted`(j), and all coarse ones.
  template <typename Wanted>
  void compute_row(std::uint32_t i, const Wanted& wanted, Scratch& scratch,
                   std::vector<ExchangeEntry>& row) {
    append_fine(i, settings_.probe_rays, wanted, scratch, row);
    append_coarse(i, row);
    row.shrink_to_fit();  // all rows together are the largest thing there is
    std::ranges::sort(row, {}, &ExchangeEntry::column);
  }

  /// Adds the pairs (i, j) that are not coarse and have `wanted`(j). Each first gets `probe` rays,
  /// which show whether it needs more.
  template <typename Wanted>
  void append_fine(std::uint32_t i, std::size_t probe, const Wanted& wanted, Scratch& scratch,
                   std::vector<ExchangeEntry>& row) {
    shadow_rays_.find_facing(i, scratch.facing, [&](std::uint32_t j) {
      return wanted(j) && !is_coarse_pair(geometry_, i, j);
    });
    shadow_rays_.make_probe_rays(i, scratch.facing, static_cast<int>(probe), scratch.rays);
    trace(scratch);
    scratch.mixed.clear();
    scratch.large_mixed.clear();
    for (std::size_t p = 0; p < scratch.facing.size(); ++p) {
      const FacingPatch& pair = scratch.facing[p];
      const auto agreement =
          ShadowRays::agreement(std::span(scratch.rays).subspan(p * probe, probe),
                                std::span(scratch.transmitted).subspan(p * probe, probe));
      if (agreement == ShadowRays::Agreement::kMixed ||
          is_contradicted(i, pair, agreement, kDoubt)) {
        (is_large_pair(geometry_, i, pair) ? scratch.large_mixed : scratch.mixed).push_back(pair);
      } else if (agreement == ShadowRays::Agreement::kClear) {
        append_clear(pair, row);
      }
    }
    append_mixed(i, scratch.mixed, settings_.full_rays, scratch, row);
    append_mixed(i, scratch.large_mixed, kLargeFactor * settings_.full_rays, scratch, row);
    pair_count_ += scratch.facing.size();
    ray_count_ += scratch.facing.size() * probe;
  }

  /// With fewer rays than the default, rows are noisy, and more rays for some of them would only
  /// cost time.
  double row_sum_tolerance() const {
    return kRowSumTolerance *
           std::max(1.0, static_cast<double>(kDefaultRays) / settings_.full_rays);
  }

  /// True if the hemisphere rays contradict the agreeing rays of a pair: by this number of
  /// `deviations` if the pair counts as clear.
  bool is_contradicted(std::uint32_t i, const FacingPatch& pair, ShadowRays::Agreement agreement,
                       double deviations) const {
    const double count = hemisphere_->find(i, pair.patch).count;
    if (agreement == ShadowRays::Agreement::kHidden) return count > 0;
    const double expected = hemisphere_->expected_count(i, pair.patch, pair.unoccluded);
    // The deviation is that of random rays. It is larger than that of these rays, because among
    // many thousand pairs no pair with an exact kernel may be lost to chance.
    return std::abs(count - expected) > deviations * std::sqrt(expected + 1);
  }

  /// Traces more probe rays for the fine pairs of row i that have a doubtful patch, and replaces
  /// their entries.
  void refine_row(std::uint32_t i, const std::vector<bool>& doubtful, Scratch& scratch,
                  std::vector<ExchangeEntry>& row) {
    const auto is_doubtful = [&](std::uint32_t j) { return doubtful[i] || doubtful[j]; };
    std::erase_if(row, [&](const ExchangeEntry& entry) {
      return is_doubtful(entry.column) && !is_coarse_pair(geometry_, i, entry.column);
    });
    append_fine(i, static_cast<std::size_t>(kRefinedProbes) * settings_.probe_rays, is_doubtful,
                scratch, row);
    std::ranges::sort(row, {}, &ExchangeEntry::column);
  }

  /// Traces `full` rays for each of `pairs` and adds the mean of shadow rays and hemisphere rays,
  /// weighted by the inverse of their variances, to row i.
  void append_mixed(std::uint32_t i, const std::vector<FacingPatch>& pairs, int full,
                    Scratch& scratch, std::vector<ExchangeEntry>& row) {
    shadow_rays_.make_rays(i, pairs, full, scratch.rays);
    trace(scratch);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const FacingPatch& pair = pairs[p];
      const ShadowRays::Visibility visible =
          ShadowRays::visibility(std::span(scratch.rays).subspan(p * full, full),
                                 std::span(scratch.transmitted).subspan(p * full, full));
      if (visible.part == 1 &&
          !is_contradicted(i, pair, ShadowRays::Agreement::kClear, kContradiction)) {
        append_clear(pair, row);
      } else {
        append_mean(i, pair, visible, row);
      }
    }
    ray_count_ += pairs.size() * full;
  }

  /// Adds the mean of `visible` and of the hemisphere rays. Both variances follow from one common
  /// estimate: with an estimate of its own, each side would count more the less light it finds.
  void append_mean(std::uint32_t i, const FacingPatch& pair, const ShadowRays::Visibility& visible,
                   std::vector<ExchangeEntry>& row) const {
    const double most = pair.unoccluded, shadow = most * visible.part;
    const double met = hemisphere_->find(i, pair.patch).exchange;
    const double guess = std::min(most, 0.5 * (shadow + met));
    const double shadow_variance = most * most * variance_of_part(guess / most, visible);
    const double met_variance = hemisphere_->variance(i, pair.patch, guess);
    const double both = shadow_variance + met_variance;
    append(row, pair, (shadow * met_variance + met * shadow_variance) / both,
           shadow_variance * met_variance / both);
  }

  static void append_clear(const FacingPatch& pair, std::vector<ExchangeEntry>& row) {
    append(row, pair, pair.unoccluded,
           kVisibilityVarianceFloor * pair.unoccluded * pair.unoccluded);
  }

  /// The variance of `visible` if `part` of the light passes. Rays that are dimmed, as by glass,
  /// spread less than rays that either pass or are stopped.
  static double variance_of_part(double part, const ShadowRays::Visibility& visible) {
    const double binary = visible.part * (1 - visible.part), rays = visible.ray_count;
    const double spread = binary > 0 ? visible.variance * rays / binary : 1;
    // No fraction is known better than this number of rays tells (rule of succession).
    const double expected = (part * rays + 1) / (rays + 2), least = 1 / (rays + 2);
    return kSpreadGain * std::max(spread * expected * (1 - expected) / (rays + 1), least * least);
  }

  /// Adds the near pairs of many triangles to row i, from hemisphere rays.
  void append_coarse(std::uint32_t i, std::vector<ExchangeEntry>& row) const {
    for (const HemisphereExchange::Pair& pair : hemisphere_->pairs(i)) {
      if (!is_coarse_pair(geometry_, i, pair.patch)) continue;
      append(row, {pair.patch, pair.exchange}, pair.exchange,
             hemisphere_->variance(i, pair.patch, pair.exchange));
    }
  }

  /// Traces the rays of the pairs of a patch. Where a surface has holes, the mean of a triangle is
  /// all that patches resolve; using it keeps the noise of single holes out of F.
  void trace(Scratch& scratch) const {
    scratch.transmitted.resize(scratch.rays.size());
    tracer_.transmittance(scratch.rays, PassageDetail::kTriangle, scratch.transmitted);
  }

  /// Adds a pair with this `exchange`, m², and variance, m⁴.
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

bool is_large_pair(const PatchGeometry& geometry, std::uint32_t i, const FacingPatch& pair) {
  return pair.unoccluded > kLargePart * std::min(geometry.area(i), geometry.area(pair.patch));
}

RawExchange compute_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                 const RayTracer& tracer, const FormFactorSettings& settings,
                                 const Progress& progress) {
  return RawExchangeBuilder(model, shadow_rays, tracer, settings, progress).run();
}

FormFactorForecast forecast_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                         const RayTracer& tracer,
                                         const FormFactorSettings& settings,
                                         const Progress& progress) {
  return RawExchangeBuilder(model, shadow_rays, tracer, settings, progress).forecast();
}

}  // namespace rebounce
