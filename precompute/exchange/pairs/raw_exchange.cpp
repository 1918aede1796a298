#include "precompute/exchange/pairs/raw_exchange.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/exchange/pairs/adaptive_row_sampling.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/pair_exchange.h"
#include "precompute/exchange/pairs/row_sum_targets.h"

namespace rebounce {
namespace {

// A row is traced again with this multiple of the probe rays if its sum is off its target by more
// than the tolerance (and three deviations), for settings with at least the default number of rays
// (lab/005).
constexpr double kRowSumTolerance = 6e-4;
constexpr int kDefaultRays = 64;

// A forecast samples one of kForecastShare patches, within these limits, in runs of neighbours,
// whose rays meet similar surfaces.
constexpr std::size_t kForecastShare = 32, kForecastLeast = 128, kForecastMost = 512;
constexpr std::size_t kForecastRun = 8;

/// Some patches, in runs of neighbours.
class PatchSample {
 public:
  explicit PatchSample(std::size_t patch_count) : run_(patch_count, kNoRun) {
    const std::size_t wanted =
        std::clamp(patch_count / kForecastShare, kForecastLeast, kForecastMost);
    const std::size_t runs = std::min(wanted / kForecastRun, patch_count);
    const std::size_t length = std::min(patch_count / runs, kForecastRun);
    for (std::size_t run = 0; run < runs; ++run) {
      const std::size_t begin = (2 * run + 1) * patch_count / (2 * runs) - length / 2;
      for (std::size_t k = begin; k < begin + length; ++k) {
        patches_.push_back(static_cast<std::uint32_t>(k));
        run_[k] = static_cast<std::uint32_t>(run);
      }
    }
    const std::size_t within = runs * length * length;
    pair_count_ = (patches_.size() * patches_.size() - within) / 2;
  }

  const std::vector<std::uint32_t>& patches() const { return patches_; }
  bool has(std::uint32_t i) const { return run_[i] != kNoRun; }

  /// The pairs of patches of different runs. Neighbours see each other less than others do.
  std::size_t pair_count() const { return pair_count_; }
  /// The number of them in row i.
  std::size_t count_pairs(std::uint32_t i, std::span<const ExchangeEntry> row) const {
    return static_cast<std::size_t>(std::ranges::count_if(row, [&](const ExchangeEntry& entry) {
      return has(entry.column) && run_[entry.column] != run_[i];
    }));
  }

 private:
  static constexpr std::uint32_t kNoRun = 0xFFFFFFFF;
  std::vector<std::uint32_t> patches_, run_;
  std::size_t pair_count_ = 0;
};

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
    const PatchSample sample(n);
    const auto wanted = [&](std::uint32_t j) { return sample.has(j); };
    const auto begin = Clock::now();
    trace_hemispheres(sample.patches(), [](double done) { return 0.5 * done; });
    const auto between = Clock::now();
    std::atomic<std::size_t> entries = 0;
    for_each_patch(
        sample.patches(),
        [&](std::uint32_t i, Scratch& scratch) {
          std::vector<ExchangeEntry> row;
          compute_row(i, wanted, scratch, row);
          entries += sample.count_pairs(i, row);
        },
        [](double done) { return 0.5 + 0.5 * done; });
    const std::chrono::duration<double> hemispheres = between - begin,
                                        pairs = Clock::now() - between;
    const double share = static_cast<double>(n) / static_cast<double>(sample.patches().size());
    const double sampled_pairs = static_cast<double>(std::max<std::size_t>(1, sample.pair_count()));
    return {hemispheres.count() * share + pairs.count() * share * share,
            static_cast<double>(hemisphere_ray_count(n)) +
                static_cast<double>(ray_count_) * share * share,
            static_cast<double>(entries) / sampled_pairs * static_cast<double>(n * n) / 2};
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Scratch {
    std::vector<FacingPatch> facing;
    PairExchange::Scratch pairs;
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
    parallel_loop(
        patches.size(), 4, [] { return Scratch(); },
        [&](std::size_t k, Scratch& scratch) {
          if (loop.stopped()) return;
          work(patches[k], scratch);
          loop.advance();
        });
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
    pair_exchange_.emplace(shadow_rays_, tracer_, *hemisphere_, settings_);
    return escape;
  }

  /// The pairs (i, j) that are not coarse and have `wanted`(j), and all coarse ones.
  template <typename Wanted>
  void compute_row(std::uint32_t i, const Wanted& wanted, Scratch& scratch,
                   std::vector<ExchangeEntry>& row) {
    append_fine(i, settings_.probe_rays, wanted, scratch, row);
    pair_count_ += scratch.facing.size();
    append_coarse(i, row);
    finish(row);
  }

  /// Adds the pairs (i, j) that are not coarse and have `wanted`(j), with `probe` rays at first.
  template <typename Wanted>
  void append_fine(std::uint32_t i, int probe, const Wanted& wanted, Scratch& scratch,
                   std::vector<ExchangeEntry>& row) {
    shadow_rays_.find_facing(i, scratch.facing, [&](std::uint32_t j) {
      return wanted(j) && !is_coarse_pair(geometry_, i, j);
    });
    for (FacingPatch& pair : scratch.facing) pair.count = hemisphere_->find(i, pair.patch).count;
    scratch.pairs.ray_count = 0;
    pair_exchange_->measure(i, scratch.facing, probe, scratch.pairs, row);
    ray_count_ += scratch.pairs.ray_count;
  }

  /// With fewer rays than the default, rows are noisy, and more rays for some of them would only
  /// cost time.
  double row_sum_tolerance() const {
    return kRowSumTolerance *
           std::max(1.0, static_cast<double>(kDefaultRays) / settings_.full_rays);
  }

  /// Traces more probe rays for the fine pairs of row i that have a doubtful patch, and replaces
  /// their entries.
  void refine_row(std::uint32_t i, const std::vector<bool>& doubtful, Scratch& scratch,
                  std::vector<ExchangeEntry>& row) {
    const auto is_doubtful = [&](std::uint32_t j) { return doubtful[i] || doubtful[j]; };
    std::erase_if(row, [&](const ExchangeEntry& entry) {
      return is_doubtful(entry.column) && !is_coarse_pair(geometry_, i, entry.column);
    });
    append_fine(i, kRefinedProbes * settings_.probe_rays, is_doubtful, scratch, row);
    finish(row);
  }

  static void finish(std::vector<ExchangeEntry>& row) {
    row.shrink_to_fit();  // all rows together are the largest thing there is
    std::ranges::sort(row, {}, &ExchangeEntry::column);
  }

  /// Adds the near pairs of many triangles to row i, from hemisphere rays.
  void append_coarse(std::uint32_t i, std::vector<ExchangeEntry>& row) const {
    for (const HemisphereExchange::Pair& pair : hemisphere_->pairs(i)) {
      if (!is_coarse_pair(geometry_, i, pair.patch)) continue;
      pair_exchange_->count_coarse(i, pair.patch, pair.count, row);
    }
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  const Progress& progress_;
  const PatchTriangles patch_triangles_;
  const PatchGeometry& geometry_;
  const ShadowRays& shadow_rays_;
  std::optional<HemisphereExchange> hemisphere_;
  std::optional<PairExchange> pair_exchange_;
  std::atomic<std::uint64_t> ray_count_ = 0, pair_count_ = 0;
};

}  // namespace

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
