#pragma once

// Direct light of lamps that have moved: how long it takes, and how far it is off.

#include <memory>
#include <string>
#include <vector>

#include "bench/support/timing.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// Differences of direct light from that with all points traced: of its area-weighted L2 norm.
struct DirectErrors {
  double mean = 0, largest = 0;
};

/// Lamps of every type that has a place, 1, 4 and 16 of them, in two places each, so that every run
/// finds them moved.
class DirectCases {
 public:
  /// `data` and `tracer` must outlive the object.
  DirectCases(const TransferData& data, const RayTracer& tracer);

  struct Row {
    std::string name;
    std::size_t lights;
    DirectErrors errors;  ///< over those of 64 lamps of the type that light anything
  };
  const std::vector<Row>& rows() const { return rows_; }

  /// Runs of each case: with the lamps in either place.
  static constexpr int kRuns = 2;
  /// Two cases for each row: by the runtime, and with all points traced.
  void add_to(std::vector<TimedCase>& cases);

 private:
  std::vector<Light> lamps(LightType type, std::size_t count) const;
  DirectErrors errors(LightType type);

  const TransferData& data_;
  const RayTracer& tracer_;
  DirectLighting fast_, traced_;
  std::vector<Float3> irradiance_, reference_;
  std::vector<Row> rows_;
};

/// What the ray tracer alone takes for 16,384 of the rays of a frame: from patches to one lamp.
TimedCase bare_rays(const TransferData& data, const RayTracer& tracer);

}  // namespace rebounce::bench
