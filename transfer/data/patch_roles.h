#pragma once

#include <cstddef>

#include "rebounce/scene_data.h"

namespace rebounce {

/// Throws Error unless there is a role for each of `patch_count` patches, or none at all, all are
/// of the bits above, and there are a receiver and a source.
void check_roles(const PatchRoles& roles, std::size_t patch_count);

}  // namespace rebounce
