#pragma once

#include <string>

#include "precompute/base/checkpoint.h"
#include "precompute/exchange/links/links.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_settings.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

/// A hash of all that the links of find_links depend on, as its arguments are before.
std::string identity_of_links(const PatchModel& model, const PatchRoles& roles, bool judged,
                              const BuildSettings& decided);

/// Keeps links, and what was found with them. `epsilon`: the link_epsilon that they have. Throws
/// Error if they cannot be written.
void keep_links(const Checkpoint& checkpoint, const LinkBuild& build, double epsilon);

/// Reads what keep_links has kept. Returns false, and leaves `build` empty, if it is not there. All
/// ranks call it.
bool find_kept_links(const Checkpoint& checkpoint, LinkBuild& build, double& epsilon);

}  // namespace rebounce
