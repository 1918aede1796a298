#pragma once

#include <cstdint>

namespace rebounce {

/// Where loops run: by default on OpenMP's threads if the library is built with them, else on the
/// calling thread. An engine that has threads of its own gives its own function.
///
/// Results have the same bits for any scheduler: loops are cut into tasks that do not depend on the
/// number of threads, each of which writes to places of its own.
struct Scheduler {
  using Task = void (*)(void* context, std::uint32_t index);

  /// Calls task(context, i) once for each i in [0, count), in any order, on any threads, and
  /// returns when all of these calls have. What the caller wrote before the call is visible to the
  /// tasks; what the tasks wrote is visible to the caller after it. Tasks throw nothing, wait for
  /// nothing and call no parallel_for. Callers on several threads that share a scheduler may call
  /// this at the same time. It must throw nothing. Null: the default.
  void (*parallel_for)(void* user, std::uint32_t count, Task task, void* context) = nullptr;
  void* user = nullptr;  ///< what parallel_for is called with
};

}  // namespace rebounce
