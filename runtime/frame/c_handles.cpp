#include "runtime/frame/c_handles.h"

#include <string>

#include "rebounce/version.h"

namespace rebounce::c {
namespace {

thread_local std::string last_error;

// Larger than the structures of any version. A larger size is memory that nobody initialised.
constexpr std::size_t kLargestStruct = 4096;

}  // namespace

rebounce_status fail(rebounce_status status, const char* message) noexcept {
  try {
    last_error = message;
  } catch (...) {
    last_error.clear();  // no memory for the message
  }
  return status;
}

rebounce_status missing(const char* function) noexcept {
  return guarded(REBOUNCE_INTERNAL, [&]() -> rebounce_status {
    const std::string text = std::string(function) + ": an argument is NULL; give all of them";
    return fail(REBOUNCE_INVALID_ARGUMENT, text.c_str());
  });
}

void check_struct_size(std::uint32_t size, std::size_t least_size, const char* init) {
  if (size >= least_size && size <= kLargestStruct) return;
  throw Error("struct_size is " + std::to_string(size) + "; fill the structure with " + init);
}

extern "C" {

uint32_t rebounce_abi_version(void) {
  return REBOUNCE_ABI_VERSION;
}

const char* rebounce_version(void) {
  return version();
}

const char* rebounce_last_error(void) {
  return last_error.c_str();
}

}  // extern "C"

}  // namespace rebounce::c
