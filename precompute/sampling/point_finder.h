#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/types.h"

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

  /// The `count` points nearest to `place`, the nearest first; fewer if there are not so many.
  std::vector<Found> nearest(const Float3& place, std::size_t count) const;

  /// Writes all points within `radius` metres of `place` to `found`, in an arbitrary order that is
  /// always the same. If they are more than `most`, the radius is divided by sqrt(2) until they are
  /// not. Returns the radius used.
  float within(const Float3& place, float radius, std::size_t most,
               std::vector<Found>& found) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace rebounce
