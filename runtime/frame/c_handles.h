#pragma once

// What the files of the C interface (rebounce.h) share: handles around the C++ classes, and
// exceptions turned into statuses.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "rebounce.h"
#include "rebounce/error.h"
#include "runtime/frame/engine_parts.h"
#include "transfer/file/transfer_data.h"

// NOLINTBEGIN(readability-identifier-naming): the names of a C interface

struct rebounce_transfer {
  std::shared_ptr<const rebounce::TransferData> data;
  std::atomic<int> references = 1;
};

struct rebounce_ies_profile {
  std::shared_ptr<const rebounce::IntensityProfile> profile;
};

struct rebounce_engine {
  rebounce::Engine engine;
  std::vector<rebounce::Light> lights;                                ///< of the current frame
  std::shared_ptr<const rebounce::SkyDistribution> sky_distribution;  ///< may be null
  rebounce::EngineUse use;                                            ///< of the two above

  explicit rebounce_engine(rebounce::Engine made) : engine(std::move(made)) {}
};

// NOLINTEND(readability-identifier-naming)

namespace rebounce::c {

static_assert(sizeof(Float3) == 3 * sizeof(float));

/// Keeps `message` for rebounce_last_error() and returns `status`.
rebounce_status fail(rebounce_status status, const char* message) noexcept;

/// Writes NULL where a call that fails leaves no handle; `handle` may be NULL itself.
template <typename Handle>
void clear(Handle** handle) {
  if (handle != nullptr) *handle = nullptr;
}

/// Fails with a message about an argument of `function` that is NULL.
rebounce_status missing(const char* function) noexcept;

/// Runs `work`; an Error from it becomes `status`.
template <typename Work>
rebounce_status guarded(rebounce_status status, const Work& work) noexcept {
  try {
    return work();
  } catch (const Unsupported& error) {
    return fail(REBOUNCE_UNSUPPORTED, error.what());
  } catch (const Error& error) {
    return fail(status, error.what());
  } catch (const std::bad_alloc&) {
    return fail(REBOUNCE_OUT_OF_MEMORY, "out of memory; close something or use a smaller scene");
  } catch (const std::exception& error) {
    return fail(REBOUNCE_INTERNAL, error.what());
  } catch (...) {
    return fail(REBOUNCE_INTERNAL, "unknown exception");
  }
}

/// A table's numbers; null if it is empty.
template <typename Triple>
const float* floats(std::span<const Triple> values) {
  return values.empty() ? nullptr : values.front().data();
}

inline Float3 triple(const float* values) {
  return {values[0], values[1], values[2]};
}

/// Throws Error unless `size` is that of some version of a structure of at least `least_size`
/// bytes, which the function `init` fills in.
void check_struct_size(std::uint32_t size, std::size_t least_size, const char* init);

/// What a caller states as its size in the first member of a structure. An older version, with
/// fewer members, may be aligned to less than today's.
inline std::uint32_t stated_size(const void* given) {
  std::uint32_t size;
  std::memcpy(&size, given, sizeof(size));
  return size;
}

/// Copies the members that the caller's version of the structure has; the others keep `defaults`.
template <typename Struct>
Struct take(const void* given, Struct defaults, std::size_t least_size, const char* init) {
  static_assert(offsetof(Struct, struct_size) == 0);
  const std::uint32_t size = stated_size(given);
  check_struct_size(size, least_size, init);
  std::memcpy(&defaults, given, std::min<std::size_t>(size, sizeof(Struct)));
  return defaults;
}

/// Copies to `given`, which may be NULL, as many bytes of `defaults` as the caller's version of the
/// structure has, and its size.
template <typename Struct>
void init_sized(void* given, Struct defaults, std::uint32_t struct_size) {
  if (given == nullptr || struct_size < sizeof(struct_size)) return;
  defaults.struct_size = struct_size;
  std::memcpy(given, &defaults, std::min<std::size_t>(struct_size, sizeof(Struct)));
  if (struct_size <= sizeof(Struct)) return;
  std::memset(static_cast<char*>(given) + sizeof(Struct), 0, struct_size - sizeof(Struct));
}

/// Reads light k of an array whose entries have the size that the caller states.
void take_light(const rebounce_light* lights, std::size_t k, Light& light);

/// Copies to the caller's structure the members that its version has.
template <typename Struct>
void give(const Struct& filled, void* given) {
  std::memcpy(given, &filled, std::min<std::size_t>(stated_size(given), sizeof(Struct)));
}

}  // namespace rebounce::c
