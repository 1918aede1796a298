#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/transfer/types.h"

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

  /// All points within `radius` metres of `place`, in ascending order.
  std::vector<Found> within(const Float3& place, float radius) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace rebounce
