#pragma once

// The points of patches that receive direct light, the same for every light and every frame.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/frame/receiver_order.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/patch_points.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Patches by slots: their places in an order in which neighbours follow each other. kBlock slots
/// make a block, kPart slots a part of one.
struct Receivers {
  static constexpr std::size_t kBlock = PatchPointBlock::kSize, kPart = UnitLightBlock::kPart;
  using Reached = std::array<bool, kBlock / kPart>;  ///< parts of a block

  /// Takes the points of the patches of `data` (receiver_points). Throws Error if a setting is out
  /// of range.
  Receivers(const TransferData& data, const DirectLightingSettings& settings);

  std::size_t points_per_patch, area_light_samples;
  std::vector<std::uint32_t> patch;    ///< [slots]
  std::vector<PatchPointBlock> point;  ///< [blocks][points_per_patch], one for each slot
  std::vector<ReceiverBounds> bounds;  ///< [parts] of their points
  /// [points_per_patch][area_light_samples] sample points, for every lamp with a surface.
  std::vector<glm::vec2> places;
  /// [parts] what is added to the sample points of each patch, u and v.
  std::vector<std::array<PartValues, 2>> shift;

  std::size_t size() const { return patch.size(); }
  std::size_t block_count() const { return point.size() / points_per_patch; }
  std::size_t slots_in(std::size_t block) const;

  /// Point `k` of every slot of a block.
  const PatchPointBlock& points(std::size_t block, std::size_t k) const {
    return point[block * points_per_patch + k];
  }

  /// The parts of a block where something of `lamp` may arrive (ReceiverBounds::may_receive).
  Reached reached(std::size_t block, const PreparedLight& lamp) const;

 private:
  void add_slot(std::uint32_t of_patch, std::span<const LitPoint> points);
};

}  // namespace rebounce
