#include "precompute/outputs/lightmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

#include "precompute/outputs/page_packing.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// Coordinates may leave [0, 1] by rounding errors.
constexpr double kSlack = 1e-4;

// A page is checked at this number of texels a side, and left out if more than this fraction of its
// covered texels is covered twice. Charts that are packed without a gap share a few texels at their
// edges.
constexpr int kOverlapTexels = 512;
constexpr double kLargestOverlap = 0.01;

// Texels around a page that belong to no other page, and the least size of a page.
constexpr double kGutter = 1;
constexpr std::uint32_t kLeastTile = 8;

constexpr std::uint32_t kLargestPadding = 64;

using TexcoordCorners = std::array<glm::dvec2, 3>;

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

double texcoord_area(const TexcoordCorners& p) {
  return 0.5 * std::abs(cross(p[1] - p[0], p[2] - p[0]));
}

/// Weights of the second and third corner.
glm::dvec2 weights_at(const TexcoordCorners& p, const glm::dvec2& at) {
  const double whole = cross(p[1] - p[0], p[2] - p[0]);
  return {cross(at - p[0], p[2] - p[0]) / whole, cross(p[1] - p[0], at - p[0]) / whole};
}

bool is_inside(const glm::dvec2& weight, double margin) {
  return weight.x > margin && weight.y > margin && weight.x + weight.y < 1 - margin;
}

/// A place on a triangle of the texture.
struct Place {
  glm::dvec2 weight{0};  ///< weights of the second and third corner
  double distance_squared = std::numeric_limits<double>::max();
};

/// The place nearest to `at`.
Place nearest_place(const TexcoordCorners& p, const glm::dvec2& at) {
  const glm::dvec2 inside = weights_at(p, at);
  if (is_inside(inside, 0)) return {inside, 0};
  Place best;
  for (int k = 0; k < 3; ++k) {
    const glm::dvec2 from = p[k], along = p[(k + 1) % 3] - from;
    const double part = std::clamp(glm::dot(at - from, along) / glm::dot(along, along), 0.0, 1.0);
    const glm::dvec2 offset = from + part * along - at;
    if (glm::dot(offset, offset) >= best.distance_squared) continue;
    std::array<double, 3> weight{};
    weight[k] = 1 - part;
    weight[(k + 1) % 3] = part;
    best = {{weight[1], weight[2]}, glm::dot(offset, offset)};
  }
  return best;
}

/// Calls visit(x, y, centre) for the texels of a square of `side` whose centres lie within `reach`,
/// in texels, of the box around a triangle.
template <typename Visit>
void for_texels_near(const TexcoordCorners& p, double reach, int side, const Visit& visit) {
  const auto first = [&](double low) {
    return std::clamp(static_cast<int>(std::ceil(low - reach - 0.5)), 0, side);
  };
  const auto last = [&](double high) {
    return std::clamp(static_cast<int>(std::floor(high + reach - 0.5)), -1, side - 1);
  };
  const glm::dvec2 low = glm::min(p[0], glm::min(p[1], p[2]));
  const glm::dvec2 high = glm::max(p[0], glm::max(p[1], p[2]));
  for (int y = first(low.y); y <= last(high.y); ++y) {
    for (int x = first(low.x); x <= last(high.x); ++x) {
      visit(x, y, glm::dvec2(x + 0.5, y + 0.5));
    }
  }
}

/// One placed mesh in the lightmap.
struct Page {
  std::uint32_t number = 0;             ///< in PatchModel::lightmap_page
  std::vector<std::uint32_t> triangle;  ///< of the display mesh, ascending
  glm::dvec2 low{1}, high{0};           ///< the used part of the page
  double in_world = 0, in_page = 0;     ///< area in m², and in texture coordinates
};

class LightmapPlacer {
 public:
  LightmapPlacer(const PatchModel& model, const LightmapSettings& settings)
      : model_(model), settings_(settings) {}

  PlacedLightmap place() {
    std::vector<Page> pages = collect_pages();
    std::erase_if(pages, [&](const Page& page) { return is_left_out(page); });
    if (pages.empty()) {
      throw Error("no mesh of the scene can have a lightmap: " +
                  (placed_.warnings.empty() ? std::string("none has second texture coordinates "
                                                          "(TEXCOORD_1) on surfaces that are seen")
                                            : placed_.warnings.front()) +
                  "; unwrap them without overlap into [0, 1], or go without a lightmap");
    }
    const std::vector<Tile> tiles = pack(pages);
    begin_lightmap();
    for (std::size_t k = 0; k < pages.size(); ++k) {
      for (const std::uint32_t t : pages[k].triangle) draw(t, pages[k], tiles[k]);
    }
    return std::move(placed_);
  }

 private:
  const DisplayMesh& mesh() const { return model_.mesh; }

  TexcoordCorners texcoords(std::uint32_t t) const {
    TexcoordCorners corner;
    for (int k = 0; k < 3; ++k) {
      const Float2& at = model_.lightmap_texcoord[mesh().triangle[t][k]].texcoord;
      corner[k] = {at[0], at[1]};
    }
    return corner;
  }

  double area_in_world(std::uint32_t t) const { return area_of(corners_of(mesh(), t)); }

  /// The side of surface triangle `t` that gets texels; kNone if neither side sees anything.
  std::uint32_t mapped_side(std::uint32_t t) const {
    if (model_.shown_patch[t] != kNone) return t;
    const std::uint32_t back = mesh().back_triangle[t];
    return back != kNone && model_.shown_patch[back] != kNone ? back : kNone;
  }

  /// Triangles without area in the texture have no place in it.
  void add_triangle(Page& page, std::uint32_t t) const {
    const TexcoordCorners corner = texcoords(t);
    if (texcoord_area(corner) <= 0) return;
    page.triangle.push_back(t);
    page.in_page += texcoord_area(corner);
    page.in_world += area_in_world(t);
    for (const glm::dvec2& p : corner) {
      page.low = glm::min(page.low, p);
      page.high = glm::max(page.high, p);
    }
  }

  std::vector<Page> collect_pages() const {
    std::vector<Page> pages(model_.lightmap_page.size());
    for (std::uint32_t k = 0; k < pages.size(); ++k) pages[k].number = k;
    for (std::uint32_t t = 0; !pages.empty() && t < mesh().surface_count(); ++t) {
      const std::uint32_t side = mapped_side(t);
      if (side == kNone) continue;
      const std::uint32_t page = model_.lightmap_texcoord[mesh().triangle[side][0]].page;
      if (page != kNone) add_triangle(pages[page], side);
    }
    std::erase_if(pages, [](const Page& page) { return page.triangle.empty(); });
    return pages;
  }

  bool is_left_out(const Page& page) {
    const std::string& name = model_.lightmap_page[page.number];
    if (leaves_the_page(page)) {
      placed_.warnings.push_back(name + " has second texture coordinates outside of [0, 1]");
      return true;
    }
    const double overlap = overlapping_part(page);
    if (overlap <= kLargestOverlap) return false;
    placed_.warnings.push_back(
        fmt::format("{} has second texture coordinates that overlap on {:.0f} % of what they cover",
                    name, std::max(1.0, 100 * overlap)));
    return true;
  }

  static bool leaves_the_page(const Page& page) {
    return std::min(page.low.x, page.low.y) < -kSlack ||
           std::max(page.high.x, page.high.y) > 1 + kSlack;
  }

  /// The fraction of covered texels, by their centres, that several triangles cover.
  double overlapping_part(const Page& page) const {
    // Neighbours share their edge and no more; rounding errors are far below this.
    constexpr double kMargin = 1e-6;
    std::vector<std::uint8_t> times(std::size_t{kOverlapTexels} * kOverlapTexels, 0);
    std::size_t covered = 0, twice = 0;
    for (const std::uint32_t t : page.triangle) {
      TexcoordCorners corner = texcoords(t);
      for (glm::dvec2& p : corner) p *= kOverlapTexels;
      for_texels_near(corner, 0, kOverlapTexels, [&](int x, int y, const glm::dvec2& centre) {
        if (!is_inside(weights_at(corner, centre), kMargin)) return;
        std::uint8_t& n = times[static_cast<std::size_t>(y) * kOverlapTexels + x];
        covered += n == 0 ? 1 : 0;
        twice += n == 1 ? 1 : 0;
        n = std::min(n + 1, 2);
      });
    }
    return covered > 0 ? static_cast<double>(twice) / static_cast<double>(covered) : 0;
  }

  /// Tiles with about the same number of texels per square metre everywhere.
  std::vector<Tile> pack(std::span<const Page> pages) const {
    std::vector<glm::dvec2> extent;
    for (const Page& page : pages) {
      extent.push_back(std::sqrt(page.in_world / page.in_page) * (page.high - page.low));
    }
    std::vector<Tile> tiles = pack_pages(extent, settings_.size, kLeastTile);
    if (tiles.empty()) {
      throw Error(fmt::format(
          "a lightmap of {0} x {0} texels is too small for {1} meshes; ask for a larger one",
          settings_.size, pages.size()));
    }
    return tiles;
  }

  void begin_lightmap() {
    const std::size_t texels = std::size_t{settings_.size} * settings_.size;
    Lightmap& map = placed_.lightmap;
    map.width = map.height = settings_.size;
    map.texcoord.assign(mesh().position.size(), Float2{0, 0});
    map.has_texels.assign(mesh().triangle.size(), 0);
    map.triangle.assign(texels, kNone);
    map.weight.assign(texels, Float2{0, 0});
    // Nothing is drawn beyond the padding.
    const double reach = settings_.padding + 0.5;
    distance_squared_.assign(texels, reach * reach);
  }

  /// Gives triangle `t` the texels that no other triangle is nearer to.
  void draw(std::uint32_t t, const Page& page, const Tile& tile) {
    Lightmap& map = placed_.lightmap;
    const auto size = static_cast<int>(settings_.size);
    TexcoordCorners corner = texcoords(t);
    for (int k = 0; k < 3; ++k) {
      corner[k] =
          glm::dvec2(tile.corner) + kGutter +
          (glm::dvec2(tile.extent) - 2 * kGutter) * (corner[k] - page.low) / (page.high - page.low);
      const glm::vec2 texcoord(corner[k] / static_cast<double>(size));
      map.texcoord[mesh().triangle[t][k]] = {texcoord.x, texcoord.y};
    }
    map.has_texels[t] = 1;
    for_texels_near(corner, settings_.padding, size, [&](int x, int y, const glm::dvec2& centre) {
      const std::size_t texel = static_cast<std::size_t>(y) * settings_.size + x;
      const Place place = nearest_place(corner, centre);
      if (place.distance_squared >= distance_squared_[texel]) return;
      distance_squared_[texel] = place.distance_squared;
      map.triangle[texel] = t;
      const glm::vec2 weight(glm::clamp(place.weight, 0.0, 1.0));
      map.weight[texel] = {weight.x, std::min(weight.y, 1 - weight.x)};
    });
  }

  const PatchModel& model_;
  const LightmapSettings& settings_;
  std::vector<double> distance_squared_;  ///< [texel] from its triangle, texels²
  PlacedLightmap placed_;
};

}  // namespace

PlacedLightmap place_lightmap(const PatchModel& model, const LightmapSettings& settings) {
  if (settings.size < kSmallestLightmap || settings.size > kLargestLightmap) {
    throw Error(fmt::format("a lightmap cannot have {} texels a side; ask for {} to {}",
                            settings.size, kSmallestLightmap, kLargestLightmap));
  }
  if (settings.padding > kLargestPadding) {
    throw Error(fmt::format("a lightmap's padding of {} texels is too wide; ask for at most {}",
                            settings.padding, kLargestPadding));
  }
  return LightmapPlacer(model, settings).place();
}

}  // namespace rebounce
