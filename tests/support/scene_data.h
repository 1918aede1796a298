#pragma once

#include <utility>

#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/patches/patch_model.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// The patches and the mesh of a scene, and where light escapes from them, by default nowhere.
inline TransferData data_of(PatchModel model, EscapedLight escaped = {}) {
  TransferData data;
  data.patches = std::move(model.patches);
  data.mesh = std::move(model.mesh);
  data.sky_cells = std::move(escaped.sky_cells);
  data.patches.sky_visibility = std::move(escaped.sky_visibility);
  data.patches.absorbed = std::move(escaped.absorbed);
  data.patches.sky_visibility.resize(data.patches.size());
  data.patches.absorbed.resize(data.patches.size());
  return data;
}

}  // namespace rebounce::test
