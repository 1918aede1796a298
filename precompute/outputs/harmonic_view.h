#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "precompute/patches/hit_patch.h"
#include "rebounce/error.h"
#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The view from one place, in the first N spherical harmonics of direction.
template <std::size_t N>
struct HarmonicView {
  using Weight = std::array<float, N>;

  std::vector<std::pair<std::uint32_t, Weight>> patches;  ///< ascending
  std::vector<std::pair<std::uint32_t, Weight>> cells;    ///< cells of the sky, ascending
  Weight sky{};                                           ///< the sum of `cells`
};

/// Sums up what the rays from one place meet.
template <std::size_t N>
class HarmonicViewer {
 public:
  /// `shown_patch` is that of PatchModel; all three must outlive the object.
  HarmonicViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                 const RayTracer& tracer)
      : mesh_(mesh), shown_patch_(shown_patch), tracer_(tracer) {}

  /// Traces `rays`; prefer_lit_side corrects the hits.
  void trace(std::span<const Ray> rays, std::span<Hit> hits) {
    tracer_.intersect(rays, hits);
    for (std::size_t k = 0; k < hits.size(); ++k) {
      prefer_lit_side(mesh_, tracer_, rays[k], hits[k], coincidence_);
    }
  }

  /// Makes the view from `rays` and their `hits`; each ray stands for `solid_angle` in sr.
  HarmonicView<N> sum_up(std::span<const Ray> rays, std::span<const Hit> hits, float solid_angle) {
    by_patch_.clear();
    by_cell_.clear();
    for (std::uint32_t k = 0; k < hits.size(); ++k) {
      if (hits[k].triangle == kNone) {
        by_cell_.emplace_back(sky_cell(rays[k].direction), k);
        continue;
      }
      const std::uint32_t patch = patch_at(mesh_, shown_patch_, hits[k]);
      if (patch != kNone) by_patch_.emplace_back(patch, k);
    }
    HarmonicView<N> view;
    // A diffuse patch of radiosity B has the luminance B / pi.
    view.patches = sums(by_patch_, rays, solid_angle / std::numbers::pi_v<float>);
    view.cells = sums(by_cell_, rays, solid_angle);
    for (const auto& [cell, weight] : view.cells) {
      for (std::size_t k = 0; k < N; ++k) view.sky[k] += weight[k];
    }
    return view;
  }

 private:
  using Weight = typename HarmonicView<N>::Weight;
  // Pairs of a patch or cell and the number of a ray.
  using Seen = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  static std::vector<std::pair<std::uint32_t, Weight>> sums(Seen& seen, std::span<const Ray> rays,
                                                            float factor) {
    std::ranges::sort(seen);
    std::vector<std::pair<std::uint32_t, Weight>> result;
    for (const auto& [what, ray] : seen) {
      if (result.empty() || result.back().first != what) result.emplace_back(what, Weight{});
      const Harmonics y = spherical_harmonics(rays[ray].direction);
      for (std::size_t k = 0; k < N; ++k) result.back().second[k] += factor * y[k];
    }
    return result;
  }

  const DisplayMesh& mesh_;
  std::span<const std::uint32_t> shown_patch_;
  const RayTracer& tracer_;
  CoincidenceScratch coincidence_;
  Seen by_patch_, by_cell_;
};

/// Appends the view from one more place to `map`, a LightProbes or SurfaceHarmonics. Throws Error
/// with the message `too_much` if a file cannot number that many entries.
template <std::size_t N, typename Map>
void append_view(const HarmonicView<N>& view, const char* too_much, Map& map) {
  map.sky.push_back(view.sky);
  for (const auto& [patch, weight] : view.patches) {
    map.entry_patch.push_back(patch);
    map.entry_weight.push_back(weight);
  }
  for (const auto& [cell, weight] : view.cells) {
    map.sky_cells.entry_cell.push_back(static_cast<std::uint8_t>(cell));
    map.sky_cells.entry_weight.push_back(weight);
  }
  if (std::max(map.entry_patch.size(), map.sky_cells.entry_cell.size()) >= kNone) {
    throw Error(too_much);
  }
  map.entry_begin.push_back(static_cast<std::uint32_t>(map.entry_patch.size()));
  map.sky_cells.entry_begin.push_back(static_cast<std::uint32_t>(map.sky_cells.entry_cell.size()));
}

}  // namespace rebounce
