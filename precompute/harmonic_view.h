#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/runtime/spherical_harmonics.h"
#include "seen_patch.h"

namespace rebounce {

/// What is seen from one place, in the first N spherical harmonics of direction.
template <std::size_t N>
struct HarmonicView {
  using Weight = std::array<float, N>;

  std::vector<std::pair<std::uint32_t, Weight>> entries;  ///< ascending patches
  Weight sky{};
};

/// Adds up what rays from one place have met.
template <std::size_t N>
class HarmonicViewer {
 public:
  /// `solid_angle` in sr is what each of the `rays` stands for, which met `hits`.
  HarmonicView<N> sum_up(const DisplayMesh& mesh, std::span<const Ray> rays,
                         std::span<const Hit> hits, float solid_angle) {
    HarmonicView<N> view;
    by_patch_.clear();
    for (std::uint32_t k = 0; k < hits.size(); ++k) {
      if (hits[k].triangle == kNone) {
        add(view.sky, rays[k], solid_angle);
        continue;
      }
      const std::uint32_t patch = seen_patch(mesh, hits[k]);
      if (patch != kNone) by_patch_.emplace_back(patch, k);
    }
    std::ranges::sort(by_patch_);
    for (const auto& [patch, k] : by_patch_) {
      if (view.entries.empty() || view.entries.back().first != patch) {
        view.entries.emplace_back(patch, typename HarmonicView<N>::Weight{});
      }
      // A diffuse patch of radiosity B has the luminance B / pi.
      add(view.entries.back().second, rays[k], solid_angle / std::numbers::pi_v<float>);
    }
    return view;
  }

 private:
  static void add(std::array<float, N>& sum, const Ray& ray, float factor) {
    const Harmonics y = spherical_harmonics(ray.direction);
    for (std::size_t k = 0; k < N; ++k) sum[k] += factor * y[k];
  }

  std::vector<std::pair<std::uint32_t, std::uint32_t>> by_patch_;  ///< and number of the ray
};

}  // namespace rebounce
