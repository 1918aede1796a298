#include "precompute/sampling/point_finder.h"

#include <cmath>
#include <nanoflann.hpp>

namespace rebounce {
namespace {

/// The interface that nanoflann needs of a set of points.
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

/// The interface that nanoflann needs of a set of results. The ball shrinks while it holds too many
/// points.
class ShrinkingBall {
 public:
  ShrinkingBall(float radius, std::size_t most, std::vector<PointFinder::Found>& found)
      : radius_squared_(radius * radius), most_(most), found_(found) {}

  float radius() const { return std::sqrt(radius_squared_); }

  // NOLINTBEGIN(readability-identifier-naming): nanoflann's names
  bool full() const { return true; }
  float worstDist() const { return radius_squared_; }
  bool addPoint(float distance_squared, std::uint32_t index) {
    if (distance_squared >= radius_squared_) return true;
    found_.push_back({index, distance_squared});
    while (found_.size() > most_ && radius_squared_ > 0) shrink();
    return true;
  }
  // NOLINTEND(readability-identifier-naming)

 private:
  void shrink() {
    radius_squared_ /= 2;
    std::erase_if(found_, [this](const PointFinder::Found& f) {
      return f.distance_squared >= radius_squared_;
    });
  }

  float radius_squared_;
  std::size_t most_;
  std::vector<PointFinder::Found>& found_;
};

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

float PointFinder::within(const Float3& place, float radius, std::size_t most,
                          std::vector<Found>& found) const {
  found.clear();
  ShrinkingBall ball(radius, most, found);
  impl_->tree.findNeighbors(ball, place.data(), nanoflann::SearchParams());
  return ball.radius();
}

}  // namespace rebounce
