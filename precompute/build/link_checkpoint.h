#pragma once

#include <cstdint>
#include <string>

#include "precompute/base/checkpoint.h"
#include "precompute/build/exchange_stage.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_settings.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

/// Which memory limits of rank 0, in bytes, the same links are found with: at least `least`, below
/// `end`.
struct LinkLimits {
  std::uint64_t least = 0, end = UINT64_MAX;
};

/// Links as near to exact form factors as they get, with the link_epsilon that they have.
struct JudgedLinks {
  FoundLinks build;
  double epsilon = 0;
  LinkLimits limits;
};

/// A hash of all that the links of find_links depend on except the memory limit, as its arguments
/// are before.
std::string identity_of_links(const PatchModel& model, const PatchRoles& roles, bool judged,
                              const BuildSettings& decided);

/// Keeps links, and what was found with them. Throws Error if they cannot be written.
void keep_links(const Checkpoint& checkpoint, const JudgedLinks& links);

/// Reads what keep_links has kept for these `patches`. Returns false, and leaves `links` empty, if
/// it is not there, or if rank 0's `memory_limit_bytes` would lead to other links. All ranks call
/// it.
bool find_kept_links(const Checkpoint& checkpoint, const PatchTable& patches,
                     std::uint64_t memory_limit_bytes, JudgedLinks& links);

}  // namespace rebounce
