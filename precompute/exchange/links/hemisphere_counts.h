#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/progress.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/patches/hit_patch.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// What cosine-distributed rays from each patch meet, kept for all that asks for it: some two bytes
/// for each patch that those of another meet. Each rank keeps what its own patches meet.
class HemisphereCounts {
 public:
  /// `ray_count` rays leave each patch at first. `model` and `tracer` must outlive the object.
  HemisphereCounts(const PatchModel& model, const RayTracer& tracer, int ray_count,
                   std::uint64_t seed);

  /// Traces the first rays of all patches. Throws Cancelled if `progress` asks to stop.
  void trace(const Progress& progress);

  /// Traces `more` [n] rays of each patch beside the first ones, where it has not as many already.
  /// Returns false if all have. Throws Cancelled if `progress` asks to stop.
  bool trace_further(std::span<const double> more, const Progress& progress);

  /// Calls `visit`(i, met) for each patch of this rank, with what its rays met, ascending; from
  /// several threads.
  template <typename Visit>
  void for_each_patch(const Visit& visit) const {
    const Ranks ranks;
    using Met = std::vector<MetPatch>;
    parallel_loop(
        first_.size(), 16, [] { return Met(); },
        [&](std::uint32_t i, Met& met) {
          if (!ranks.makes(i)) return;
          met.clear();
          unpack(first_[i], met);
          visit(i, std::span<const MetPatch>(met));
          if (further_[i].empty()) return;
          met.clear();
          unpack(further_[i], met);
          visit(i, std::span<const MetPatch>(met));
        });
  }

  /// Of the first rays [n].
  std::span<const Escape> escape() const { return escape_; }
  /// All rays of each patch [n].
  const std::vector<double>& rays() const { return rays_; }
  int first_rays() const { return first_rays_; }
  std::uint64_t traced_rays() const { return traced_; }
  std::uint64_t held_bytes() const;

 private:
  /// Pairs of the distance from the patch before and the count, each in bytes of seven bits.
  using Packed = std::vector<std::uint8_t>;

  static Packed pack(std::span<const MetPatch> met);
  static void unpack(const Packed& packed, std::vector<MetPatch>& met);

  template <typename Keep>
  void trace(std::span<const double> count, std::uint64_t seed, const Progress& progress,
             const Keep& keep);

  const PatchModel& model_;
  const RayTracer& tracer_;
  const int first_rays_;
  const std::uint64_t seed_;
  const PatchTriangles triangles_;
  std::vector<Packed> first_, further_;  ///< [n]
  std::vector<Escape> escape_;           ///< [n]
  std::vector<double> rays_;             ///< [n]
  std::uint64_t traced_ = 0;
};

}  // namespace rebounce
