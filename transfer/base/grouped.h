#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// Lists of numbers, one list per group, in one array. A group keeps the order in which its numbers
/// were added. `Index` can hold the total count.
template <typename Index>
class Grouped {
 public:
  /// `give`(add) calls add(group, number) for each number; groups are < `group_count`. The
  /// constructor calls it twice, and both calls must add the same numbers.
  template <typename Give>
  Grouped(std::size_t group_count, const Give& give) : begin_(group_count + 1, 0) {
    give([&](std::size_t group, std::uint32_t /*number*/) { ++begin_[group + 1]; });
    for (std::size_t group = 0; group < group_count; ++group) begin_[group + 1] += begin_[group];
    number_.resize(begin_.back());
    std::vector<Index> next(begin_.begin(), begin_.end() - 1);
    give([&](std::size_t group, std::uint32_t number) { number_[next[group]++] = number; });
  }

  std::size_t group_count() const { return begin_.size() - 1; }
  std::size_t size() const { return number_.size(); }  ///< numbers of all groups

  std::span<const std::uint32_t> operator[](std::size_t group) const {
    return {number_.data() + begin_[group], number_.data() + begin_[group + 1]};
  }

  /// The numbers of a group, to be put into another order.
  std::span<std::uint32_t> operator[](std::size_t group) {
    return {number_.data() + begin_[group], number_.data() + begin_[group + 1]};
  }

  /// [groups + 1] index of each group's first number; the last entry is size()
  const std::vector<Index>& offsets() const { return begin_; }

 private:
  std::vector<Index> begin_;
  std::vector<std::uint32_t> number_;
};

}  // namespace rebounce
