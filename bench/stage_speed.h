#pragma once

#include <map>
#include <memory>
#include <string>

#include "bench/bare_embree.h"
#include "bench/timing.h"
#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {

/// What the form-factor phase consists of, each part timed by itself: the rays of evenly spread
/// rows, traced by bare Embree and by RayTracer, and the search for pairs with their kernels.
class StageSpeed {
 public:
  /// Sampled rows are as many as keep the rays that lie ready below `ray_limit`; `ray_count` is how
  /// many the phase traces in all. `model` and `tracer` must outlive it.
  StageSpeed(const PatchModel& model, const RayTracer& tracer, const FormFactorSettings& settings,
             double ray_limit, std::uint64_t ray_count);
  ~StageSpeed();

  /// Times every part once. Throws Error if Embree does not find the same rays hidden in each mode.
  void measure_once();

  /// Seconds of one part for the sampled rows.
  Timing pairs() const { return summarise(samples_.at("pairs")); }
  Timing bare(const std::string& kind, TraceMode mode) const;

  /// Seconds for the whole phase's `shadow` and `escape` rays, in the proportion of their kinds; of
  /// repeated measurements the `figure`.
  double bare_seconds(double shadow, double escape, double Timing::*figure) const;
  double tracer_seconds(double shadow, double escape, double Timing::*figure) const;
  /// The same for finding `pairs` pairs and their kernels.
  double kernel_seconds(double pairs, double Timing::*figure) const;

  std::uint64_t shadow_count() const;  ///< rays of the sampled rows
  std::uint64_t escape_count() const;
  std::uint64_t pair_count() const { return pair_count_; }

 private:
  struct Impl;

  void add(const std::string& what, const std::function<void()>& work);
  void measure_embree();
  void measure_tracer();
  void check_agreement() const;
  void find_pairs();
  double fastest(const std::string& kind, double Timing::*figure) const;

  std::unique_ptr<Impl> impl_;
  std::uint64_t pair_count_ = 0;
  std::map<std::string, std::vector<double>> samples_;  ///< seconds
};

}  // namespace rebounce::bench
