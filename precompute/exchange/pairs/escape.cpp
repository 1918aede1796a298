#include "precompute/exchange/pairs/escape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "precompute/sampling/hemisphere_rays.h"
#include "precompute/sampling/sobol_blocks.h"
#include "rebounce/sky.h"

namespace rebounce {
namespace {

/// Adds the sky cells of one more patch, `sky` in all.
void append_sky_cells(const Escape& escape, double sky, SkyCells& cells) {
  if (cells.empty()) cells.entry_begin.push_back(0);
  for (const auto& [cell, part] : escape.sky_cells) {
    if (!(sky > 0)) break;
    cells.entry_cell.push_back(cell);
    cells.entry_part.push_back(static_cast<float>(part * sky / escape.sky));
  }
  cells.entry_begin.push_back(static_cast<std::uint32_t>(cells.entry_cell.size()));
}

using Coordinates = PatchPointBlock::Coordinates;
using Directions = std::array<Coordinates, 3>;

/// Applies to_cosine_direction() to `count` points (`u`[k], `v`[k]) of the unit square.
void fill_cosine_directions(std::size_t count, const Coordinates& u, const Coordinates& v,
                            Directions& direction) {
  for (std::size_t k = 0; k < count; ++k) {
    const float x = 2 * u[k] - 1, y = 2 * v[k] - 1;
    const bool wide = std::abs(x) > std::abs(y);
    const float r = wide ? x : y, across = wide ? y : x;
    const float quotient = across / r;
    const float angle = r == 0 ? 0 : std::numbers::pi_v<float> / 4 * quotient;
    const float along = r * small_cosine(angle), aside = r * small_sine(angle);
    direction[0][k] = wide ? along : aside;
    direction[1][k] = wide ? aside : along;
    direction[2][k] = std::max(0.0F, 1 - r * r);
  }
  for (std::size_t k = 0; k < count; ++k) direction[2][k] = std::sqrt(direction[2][k]);
}

/// Turns directions around +Z to the normals of `points` (frame_around()).
void turn_to_normals(std::size_t count, const PatchPointBlock& points, Directions& direction) {
  const auto& [nx, ny, nz] = points.normal;
  for (std::size_t k = 0; k < count; ++k) {
    const float x = direction[0][k], y = direction[1][k], z = direction[2][k];
    const float sign = std::copysign(1.0F, nz[k]);
    const float a = -1 / (sign + nz[k]), b = nx[k] * ny[k] * a;
    direction[0][k] = x * (1 + sign * nx[k] * nx[k] * a) + y * b + z * nx[k];
    direction[1][k] = x * sign * b + y * (sign + ny[k] * ny[k] * a) + z * ny[k];
    direction[2][k] = -x * sign * nx[k] - y * ny[k] + z * nz[k];
  }
}

/// Makes one cosine-distributed ray from each point of a sample of `surface`.
void make_escape_rays(const PatchSurface& surface, float offset, std::uint64_t bits,
                      std::span<Ray> rays) {
  constexpr std::size_t kBlock = SobolBlocks::kSize;
  const SobolBlocks sequence(bits);
  SobolBlocks::Block square;
  PatchPointBlock points;
  Directions direction;
  for (std::size_t begin = 0; begin < rays.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, rays.size() - begin);
    sequence.fill(static_cast<std::uint32_t>(begin / kBlock), count, square);
    surface.fill(count, square[0], square[1], offset, points);
    fill_cosine_directions(count, square[2], square[3], direction);
    turn_to_normals(count, points, direction);
    for (std::size_t k = 0; k < count; ++k) {
      Ray& ray = rays[begin + k];
      ray = {.origin = {points.position[0][k], points.position[1][k], points.position[2][k]},
             .t_near = 0,
             .direction = {direction[0][k], direction[1][k], direction[2][k]},
             .t_far = std::numeric_limits<float>::infinity()};
    }
  }
}

}  // namespace

Escape measure_escape(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                      std::span<const std::uint32_t> triangles, std::uint32_t patch,
                      const RayTracer& tracer, int ray_count, std::uint64_t seed,
                      EscapeScratch& scratch) {
  scratch.rays.resize(ray_count);
  scratch.hits.resize(ray_count);
  scratch.met.resize(ray_count);
  make_escape_rays(PatchSurface(mesh, triangles), tracer.offset_distance(),
                   mix_bits(seed ^ (patch * 2654435761ULL)), scratch.rays);
  tracer.intersect(scratch.rays, scratch.hits);

  int sky = 0, absorbed = 0;
  std::array<int, kSkyCellCount> count{};
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    Hit& hit = scratch.hits[k];
    prefer_lit_side(mesh, tracer, scratch.rays[k], hit, scratch.coincidence);
    scratch.met[k] = patch_at(mesh, shown_patch, hit);
    if (hit.triangle == kNone) {
      ++sky;
      ++count[sky_cell(scratch.rays[k].direction)];
    } else if (scratch.met[k] == kNone) {
      ++absorbed;
    }
  }
  Escape escape{static_cast<double>(sky) / ray_count, static_cast<double>(absorbed) / ray_count};
  for (std::uint32_t cell = 0; sky > 0 && cell < kSkyCellCount; ++cell) {
    if (count[cell] == 0) continue;
    escape.sky_cells.push_back({static_cast<std::uint8_t>(cell),
                                static_cast<float>(count[cell]) / static_cast<float>(ray_count)});
  }
  return escape;
}

void share(const Ranks& ranks, std::span<Escape> escape) {
  if (ranks.alone()) return;
  std::vector<std::array<double, 2>> parts;
  std::vector<std::vector<EscapeToCell>> cells;
  for (Escape& of_patch : escape) {
    parts.push_back({of_patch.sky, of_patch.absorbed});
    cells.push_back(std::move(of_patch.sky_cells));
  }
  ranks.share(std::span(parts));
  ranks.share(std::span(cells));
  for (std::size_t i = 0; i < escape.size(); ++i) {
    escape[i] = {parts[i][0], parts[i][1], std::move(cells[i])};
  }
}

EscapedLight share_escape(std::span<const double> row_sum, std::span<const Escape> escape) {
  EscapedLight result;
  for (std::size_t i = 0; i < row_sum.size(); ++i) {
    // Links with both signs can leave a row sum a little below 0 where nothing is visible.
    const double rest = std::clamp(1 - row_sum[i], 0.0, 1.0);
    const double lost = escape[i].sky + escape[i].absorbed;
    const double sky = lost > 0 ? rest * escape[i].sky / lost : 0;
    result.sky_visibility.push_back(static_cast<float>(sky));
    result.absorbed.push_back(static_cast<float>(std::max(0.0, rest - sky)));
    append_sky_cells(escape[i], sky, result.sky_cells);
  }
  return result;
}

}  // namespace rebounce
