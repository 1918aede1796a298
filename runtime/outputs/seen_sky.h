#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "runtime/lights/sky_light.h"
#include "runtime/outputs/spherical_harmonics.h"

namespace rebounce {

/// The sky that probes or patches see, as spherical harmonics: the cells of `sky` weighted by its
/// distribution. If it is uniform or the cells are not known: `uniform` for its mean.
template <typename Weight>
class SeenSky {
 public:
  SeenSky(const std::vector<Weight>& uniform, const SkyHarmonics<Weight>& cells, const Sky& sky)
      : uniform_(uniform),
        cells_(cells),
        distribution_(cells.empty() ? nullptr : sky.distribution.get()),
        luminance_(distribution_ != nullptr ? sky_luminance_unit(sky) : mean_sky_luminance(sky)) {}

  /// Multiply the coefficients by this luminance, cd/m².
  const Float3& luminance() const { return luminance_; }

  Weight coefficients(std::size_t place) const {
    if (distribution_ == nullptr) return uniform_[place];
    return sum_of_cells<Weight>(place,
                                [](const Weight& weight) -> const Weight& { return weight; });
  }

  /// Calls visit(weight, part) for each distinguishable part of the sky. The part contributes
  /// `weight` times `part` times the luminance to the coefficients.
  template <typename Visit>
  void for_each_part(std::size_t place, const Visit& visit) const {
    if (cells_.empty()) {
      visit(uniform_[place], 1.0F);
      return;
    }
    for (auto e = cells_.entry_begin[place]; e < cells_.entry_begin[place + 1]; ++e) {
      const float part = distribution_ == nullptr ? 1 : (*distribution_)[cells_.entry_cell[e]];
      visit(cells_.entry_weight[e], part);
    }
  }

  /// Degree 4, with each cell as a small spot of light; zero where the cells are not known.
  Harmonics degree_4(std::size_t place) const {
    if (cells_.empty() || luminance_ == Float3{0, 0, 0}) return {};
    return sum_of_cells<Harmonics>(place, degree_4_of_spot<std::tuple_size_v<Weight>>);
  }

 private:
  template <typename Sum, typename Of>
  Sum sum_of_cells(std::size_t place, const Of& of) const {
    Sum sum{};
    for_each_part(place, [&](const Weight& seen, float part) {
      const Sum& weight = of(seen);
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += part * weight[k];
    });
    return sum;
  }

  const std::vector<Weight>& uniform_;
  const SkyHarmonics<Weight>& cells_;
  const SkyDistribution* distribution_;
  Float3 luminance_;
};

}  // namespace rebounce
