#include "precompute/outputs/page_packing.h"

#include <stb/stb_rect_pack.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rebounce {
namespace {

// After this number of halvings of its interval, the largest scale that fits is known well below a
// texel.
constexpr int kHalvings = 24;

std::vector<Tile> pack(std::span<const glm::dvec2> extent, double scale, std::uint32_t size,
                       std::uint32_t least_side) {
  const auto side = [&](double wanted) {
    return static_cast<stbrp_coord>(
        std::clamp(scale * wanted, static_cast<double>(least_side), static_cast<double>(size)));
  };
  std::vector<stbrp_rect> rectangles(extent.size());
  for (std::size_t k = 0; k < extent.size(); ++k) {
    rectangles[k].w = side(extent[k].x);
    rectangles[k].h = side(extent[k].y);
  }
  stbrp_context context{};
  std::vector<stbrp_node> nodes(size);
  stbrp_init_target(&context, static_cast<int>(size), static_cast<int>(size), nodes.data(),
                    static_cast<int>(nodes.size()));
  std::vector<Tile> tiles;
  if (stbrp_pack_rects(&context, rectangles.data(), static_cast<int>(rectangles.size())) == 0) {
    return tiles;
  }
  for (const stbrp_rect& r : rectangles) tiles.push_back({{r.x, r.y}, {r.w, r.h}});
  return tiles;
}

}  // namespace

std::vector<Tile> pack_pages(std::span<const glm::dvec2> extent, std::uint32_t size,
                             std::uint32_t least_side) {
  if (extent.empty() || least_side > size) return {};
  std::vector<Tile> best = pack(extent, 0, size, least_side);
  if (best.empty()) return best;
  double least = std::numeric_limits<double>::max(), largest = 0;
  for (const glm::dvec2& e : extent) {
    least = std::min({least, e.x, e.y});
    largest = std::max({largest, e.x, e.y});
  }
  double low = std::log(least_side / largest), high = std::log(size / least);
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    std::vector<Tile> tiles = pack(extent, std::exp(middle), size, least_side);
    (tiles.empty() ? high : low) = middle;
    if (!tiles.empty()) best = std::move(tiles);
  }
  return best;
}

}  // namespace rebounce
