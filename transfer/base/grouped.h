#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// Numbers by groups, those of a group in the order in which they were given. `Index` counts all
/// of them.
template <typename Index>
class Grouped {
 public:
  /// `give`(add) calls add(group, number) for each number, groups below `group_count`. It is called
  /// twice and must do the same both times.
  template <typename Give>
  Grouped(std::size_t group_count, const Give& give) : begin_(group_count + 1, 0) {
    give([&](std::size_t group, std::uint32_t /*number*/) { ++begin_[group + 1]; });
    for (std::size_t group = 0; group < group_count; ++group) begin_[group + 1] += begin_[group];
    number_.resize(begin_.back());
    std::vector<Index> next(begin_.begin(), begin_.end() - 1);
    give([&](std::size_t group, std::uint32_t number) { number_[next[group]++] = number; });
  }

  std::size_t group_count() const { return begin_.size() - 1; }
  std::size_t size() const { return number_.size(); }  ///< of all groups together

  std::span<const std::uint32_t> operator[](std::size_t group) const {
    return {number_.data() + begin_[group], number_.data() + begin_[group + 1]};
  }

  /// [groups + 1] Where each group begins in a list of all numbers, group by group.
  const std::vector<Index>& offsets() const { return begin_; }

 private:
  std::vector<Index> begin_;
  std::vector<std::uint32_t> number_;
};

}  // namespace rebounce
