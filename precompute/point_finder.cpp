#include "point_finder.h"

#include <algorithm>
#include <nanoflann.hpp>

namespace rebounce {
namespace {

/// What nanoflann asks of a set of points.
struct PointSet {
  std::span<const Float3> point;

  // NOLINTBEGIN(readability-identifier-naming): nanoflann's names
  std::size_t kdtree_get_point_count() const { return point.size(); }
  float kdtree_get_pt(std::size_t index, std::size_t axis) const { return point[index][axis]; }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
  // NOLINTEND(readability-identifier-naming)
};

using PointTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSet>,
                                                      PointSet, 3, std::uint32_t>;

}  // namespace

struct PointFinder::Impl {
  explicit Impl(std::span<const Float3> point)
      : set{point}, tree(3, set, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {}

  PointSet set;
  PointTree tree;
};

PointFinder::PointFinder(std::span<const Float3> point)
    : impl_(std::make_unique<const Impl>(point)) {}

PointFinder::~PointFinder() = default;

std::vector<PointFinder::Found> PointFinder::nearest(const Float3& place, std::size_t count) const {
  std::vector<std::uint32_t> index(count);
  std::vector<float> distance_squared(count);
  const std::size_t found =
      impl_->tree.knnSearch(place.data(), count, index.data(), distance_squared.data());
  std::vector<Found> result;
  for (std::size_t k = 0; k < found; ++k) result.push_back({index[k], distance_squared[k]});
  return result;
}

std::vector<PointFinder::Found> PointFinder::within(const Float3& place, float radius) const {
  std::vector<std::pair<std::uint32_t, float>> found;
  impl_->tree.radiusSearch(place.data(), radius * radius, found, nanoflann::SearchParams());
  std::ranges::sort(found);
  std::vector<Found> result;
  for (const auto& [index, distance_squared] : found) result.push_back({index, distance_squared});
  return result;
}

}  // namespace rebounce
