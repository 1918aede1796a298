#pragma once

// Pieces of cities for the tests of view factors, out of square cells.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "precompute/facets/facets.h"

namespace rebounce::test {

/// Metres that every height of a city is a multiple of.
inline constexpr int kStorey = 2;

/// Facets of a city on a field of `width` x `depth` metres, where `height`(x, y) is the height in
/// metres over the square of two metres around the odd (x, y). Every cell is `cells_per_storey`² a
/// square, two triangles each; z is up.
class CityBuilder {
 public:
  CityBuilder(int width, int depth, int cells_per_storey, std::function<int(int, int)> height)
      : cells_(cells_per_storey),
        width_(width / kStorey * cells_),
        depth_(depth / kStorey * cells_),
        height_(std::move(height)) {}

  Facets build() {
    for (int x = 0; x < width_; ++x) {
      for (int y = 0; y < depth_; ++y) {
        const int h = at(x, y);
        quad({x, y, h}, {1, 0, 0}, {0, 1, 0});
        for (int z = at(x + 1, y); z < h; ++z) quad({x + 1, y, z}, {0, 1, 0}, {0, 0, 1});
        for (int z = at(x - 1, y); z < h; ++z) quad({x, y + 1, z}, {0, -1, 0}, {0, 0, 1});
        for (int z = at(x, y + 1); z < h; ++z) quad({x + 1, y + 1, z}, {-1, 0, 0}, {0, 0, 1});
        for (int z = at(x, y - 1); z < h; ++z) quad({x, y, z}, {1, 0, 0}, {0, 0, 1});
      }
    }
    return facets_;
  }

 private:
  using Place = std::array<int, 3>;

  /// The height over a cell, in cells.
  int at(int x, int y) const {
    if (x < 0 || y < 0 || x >= width_ || y >= depth_) return 0;
    return height_(x / cells_ * kStorey + 1, y / cells_ * kStorey + 1) / kStorey * cells_;
  }

  std::uint32_t vertex(const Place& place) {
    const auto [found, is_new] =
        number_.try_emplace(place, static_cast<std::uint32_t>(facets_.vertex.size()));
    if (is_new) {
      facets_.vertex.push_back(static_cast<double>(kStorey) / cells_ *
                               glm::dvec3(place[0], place[1], place[2]));
    }
    return found->second;
  }

  void quad(const Place& at, const Place& u, const Place& v) {
    const auto corner = [&](int a, int b) {
      return vertex(
          {at[0] + a * u[0] + b * v[0], at[1] + a * u[1] + b * v[1], at[2] + a * u[2] + b * v[2]});
    };
    const std::uint32_t p = corner(0, 0), q = corner(1, 0), r = corner(1, 1), s = corner(0, 1);
    facets_.add(std::array{p, q, r});
    facets_.add(std::array{p, r, s});
  }

  int cells_, width_, depth_;
  std::function<int(int, int)> height_;
  Facets facets_;
  std::map<Place, std::uint32_t> number_;
};

/// A street of 16 m between two rows of buildings of 12 to 20 m, with a street across: 5,400 facets
/// with one cell a storey, 22,000 with two.
inline Facets street_canyon(int cells_per_storey) {
  return CityBuilder(48, 92, cells_per_storey,
                     [](int x, int y) {
                       const bool built = (x > 4 && x < 16) || (x > 32 && x < 44);
                       const bool crossing = y < 4 || y > 88 || (y > 42 && y < 50);
                       return built && !crossing ? 12 + (x / 16 * 6 + y / 12 * 4) % 10 : 0;
                     })
      .build();
}

/// A block of 14 m around a court of 32 m square, with a passage to it: 5,500 and 22,000 facets.
inline Facets courtyard(int cells_per_storey) {
  return CityBuilder(76, 76, cells_per_storey,
                     [](int x, int y) {
                       const auto within = [&](int low, int high) {
                         return x > low && x < high && y > low && y < high;
                       };
                       const bool passage = y > 36 && y < 42 && x < 38;
                       return within(8, 68) && !within(22, 54) && !passage ? 14 : 0;
                     })
      .build();
}

}  // namespace rebounce::test
