#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// Finds the points near a place. Immutable, usable from any number of threads.
class PointFinder {
 public:
  struct Found {
    std::uint32_t index;
    float distance_squared;  ///< m²
  };

  /// `point` must outlive it.
  explicit PointFinder(std::span<const Float3> point);
  ~PointFinder();
  PointFinder(const PointFinder&) = delete;
  PointFinder& operator=(const PointFinder&) = delete;

  /// The `count` points nearest to `place`, fewer if there are not so many; the nearest first.
  std::vector<Found> nearest(const Float3& place, std::size_t count) const;

  /// Puts all points within `radius` metres of `place` into `found`, in no particular order but
  /// always the same; where they are more than `most`, only those within the largest of radius /
  /// sqrt(2)^k that are not. Returns the radius that was taken.
  float within(const Float3& place, float radius, std::size_t most,
               std::vector<Found>& found) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace rebounce
