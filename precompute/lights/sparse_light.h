#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// A light, one value for each patch, kept without the patches where it is zero: most lamps of a
/// house light one room.
class SparseLight {
 public:
  /// `light`: [n], as many values as a patch index can count at most.
  explicit SparseLight(std::span<const Float3> light);

  /// The same values, [n], zeros too.
  std::vector<Float3> expanded() const;

 private:
  /// Patches that follow each other, none of them with zero.
  struct Run {
    std::uint32_t begin, count;
  };

  std::size_t size_;  ///< n
  std::vector<Run> runs_;
  std::vector<Float3> values_;  ///< of the runs, one after the other
};

/// Keeps `lights`, each of which ends once it is kept.
std::vector<SparseLight> sparse_lights(std::vector<std::vector<Float3>> lights);

/// All values of `lights`, [lights][n].
std::vector<std::vector<Float3>> expanded(std::span<const SparseLight> lights);

}  // namespace rebounce
