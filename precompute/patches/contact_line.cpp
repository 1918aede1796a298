#include "precompute/patches/contact_line.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "precompute/sampling/box_tree.h"

namespace rebounce {
namespace {

class LineJoiner {
 public:
  LineJoiner(std::vector<ContactLine> lines, double width, double tolerance)
      : lines_(std::move(lines)), width_(width), tolerance_(tolerance), tree_(make_boxes()) {
    is_joined_.resize(lines_.size(), false);
  }

  std::vector<ContactLine> join() {
    std::vector<std::uint32_t> order(lines_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, std::greater(),
                             [&](std::uint32_t k) { return lines_[k].length(); });
    std::vector<ContactLine> joined;
    for (const std::uint32_t k : order) {
      if (!is_joined_[k]) joined.push_back(with_all_that_goes_on(lines_[k]));
    }
    return joined;
  }

 private:
  /// A range of distances along a line.
  struct Interval {
    double low, high;  ///< metres
    std::uint32_t line;
  };

  std::vector<Box> make_boxes() const {
    std::vector<Box> boxes;
    for (const ContactLine& line : lines_) boxes.push_back(box_around(line, 0));
    return boxes;
  }

  /// The box around a line that is extended by `more` metres at each end.
  Box box_around(const ContactLine& line, double more) const {
    const glm::vec3 margin(static_cast<float>(width_ + tolerance_));
    Box box;
    box.add(line.begin() - more * line.direction());
    box.add(line.end() + more * line.direction());
    return {box.low - margin, box.high + margin};
  }

  ContactLine with_all_that_goes_on(ContactLine line) {
    // Each step looks twice as far, so that the region stays about as long as the joined line.
    for (double before = 0; line.length() > before;) {
      before = line.length();
      line = grow(line, intervals_near(line));
    }
    return line;
  }

  /// The ranges of lines that are still free and close enough to a line, up to its length beyond
  /// its ends; the lowest first.
  std::vector<Interval> intervals_near(const ContactLine& line) {
    tree_.find({box_around(line, line.length()), {}}, found_);
    std::vector<Interval> intervals;
    for (const std::uint32_t k : found_) {
      const glm::dvec3 begin = lines_[k].begin(), end = lines_[k].end();
      const double off = std::max(std::abs(line.across(begin)), std::abs(line.across(end)));
      if (is_joined_[k] || off > width_) continue;
      const auto [low, high] = std::minmax({line.along(begin), line.along(end)});
      intervals.push_back({low, high, k});
    }
    std::ranges::sort(intervals, {}, &Interval::low);
    return intervals;
  }

  /// Joins a line with the ranges that touch it, and with those that touch one another from it on.
  ContactLine grow(const ContactLine& line, const std::vector<Interval>& intervals) {
    double first = 0, last = line.length();
    const auto take = [&](const Interval& interval) {
      if (interval.high < first - tolerance_ || interval.low > last + tolerance_) return;
      is_joined_[interval.line] = true;
      first = std::min(first, interval.low);
      last = std::max(last, interval.high);
    };
    for (double before = 0; last - first > before;) {
      before = last - first;
      std::ranges::for_each(intervals, take);
      std::for_each(intervals.rbegin(), intervals.rend(), take);
    }
    return line.part(first, last);
  }

  std::vector<ContactLine> lines_;
  double width_, tolerance_;  ///< metres
  BoxTree tree_;              ///< over the lines
  std::vector<bool> is_joined_;
  std::vector<std::uint32_t> found_;
};

}  // namespace

ContactLine::ContactLine(const glm::dvec3& begin, const glm::dvec3& end, const glm::dvec3& normal)
    : begin_(begin),
      direction_(glm::normalize(end - begin)),
      across_(glm::cross(normal, direction_)),
      length_(glm::distance(begin, end)) {}

bool ContactLine::crosses(const std::array<glm::dvec3, 3>& corner,
                          const std::array<double, 3>& across, double tolerance) const {
  const auto [lowest, highest] = std::ranges::minmax(across);
  if (lowest >= 0 || highest <= 0) return false;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto reach = [&](const glm::dvec3& point) {
    low = std::min(low, along(point));
    high = std::max(high, along(point));
  };
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (across[k] == 0) reach(corner[k]);
    if (across[k] * across[next] < 0) {
      reach(glm::mix(corner[k], corner[next], across[k] / (across[k] - across[next])));
    }
  }
  return std::min(high, length_) - std::max(low, 0.0) > tolerance;
}

ContactLine ContactLine::part(double first, double last) const {
  ContactLine part = *this;
  part.begin_ += first * direction_;
  part.length_ = last - first;
  return part;
}

std::vector<ContactLine> join_lines(std::vector<ContactLine> lines, double width,
                                    double tolerance) {
  return LineJoiner(std::move(lines), width, tolerance).join();
}

}  // namespace rebounce
