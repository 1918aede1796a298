#include "escape.h"

#include <algorithm>
#include <array>

#include "hemisphere_rays.h"
#include "rebounce/transfer/sky_cells.h"

namespace rebounce {
namespace {

/// Adds the cells by which one more patch sees the sky, `sky` in all.
void append_sky_cells(const Escape& escape, double sky, SkyCells& cells) {
  if (cells.empty()) cells.entry_begin.push_back(0);
  for (const auto& [cell, part] : escape.sky_cells) {
    if (!(sky > 0)) break;
    cells.entry_cell.push_back(cell);
    cells.entry_part.push_back(static_cast<float>(part * sky / escape.sky));
  }
  cells.entry_begin.push_back(static_cast<std::uint32_t>(cells.entry_cell.size()));
}

}  // namespace

Escape measure_escape(const PatchModel& model, std::span<const std::uint32_t> triangles,
                      std::uint32_t patch, const RayTracer& tracer, int ray_count,
                      std::uint64_t seed, EscapeScratch& scratch) {
  scratch.points.resize(ray_count);
  scratch.rays.resize(ray_count);
  scratch.hits.resize(ray_count);
  const std::uint64_t bits = mix_bits(seed ^ (patch * 2654435761ULL));
  spread_points(model.mesh, triangles, unit_square(mix_bits(bits)), scratch.points);
  make_hemisphere_rays(scratch.points, tracer, unit_square(mix_bits(bits + 1)), scratch.rays);
  tracer.intersect(scratch.rays, scratch.hits);

  int sky = 0, absorbed = 0;
  std::array<int, kSkyCellCount> count{};
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    Hit& hit = scratch.hits[k];
    prefer_lit_side(model.mesh, tracer, scratch.rays[k], hit, scratch.coincidence);
    if (hit.triangle == kNone) {
      ++sky;
      ++count[sky_cell(scratch.rays[k].direction)];
    } else if (patch_at(model.mesh, model.shown_patch, hit) == kNone) {
      ++absorbed;
    }
  }
  Escape escape{static_cast<double>(sky) / ray_count, static_cast<double>(absorbed) / ray_count};
  for (std::uint32_t cell = 0; sky > 0 && cell < kSkyCellCount; ++cell) {
    if (count[cell] == 0) continue;
    escape.sky_cells.emplace_back(static_cast<std::uint8_t>(cell),
                                  static_cast<float>(count[cell]) / static_cast<float>(ray_count));
  }
  return escape;
}

EscapedLight share_escape(std::span<const double> row_sum, std::span<const Escape> escape) {
  EscapedLight result;
  for (std::size_t i = 0; i < row_sum.size(); ++i) {
    const double rest = std::max(0.0, 1 - row_sum[i]), lost = escape[i].sky + escape[i].absorbed;
    const double sky = lost > 0 ? rest * escape[i].sky / lost : 0;
    result.sky_visibility.push_back(static_cast<float>(sky));
    result.absorbed.push_back(static_cast<float>(std::max(0.0, rest - sky)));
    append_sky_cells(escape[i], sky, result.sky_cells);
  }
  return result;
}

}  // namespace rebounce
