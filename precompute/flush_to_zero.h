#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace rebounce {

/// Takes denormal numbers for zero, in and out of operations of the thread that makes it, for as
/// long as this lives. Processors of Intel take a hundred cycles and more for one operation on
/// them. On other processors than x86-64 nothing changes.
class FlushToZero {
 public:
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

#if defined(__x86_64__)
  FlushToZero() : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | kDenormalsAreZero);
  }
  ~FlushToZero() {
    _mm_setcsr(before_);
  }

 private:
  // _MM_DENORMALS_ZERO_ON, which compilers declare for targets with SSE3 alone.
  static constexpr unsigned kDenormalsAreZero = 0x40;

  unsigned before_;
#else
  FlushToZero() {}
#endif
};

}  // namespace rebounce
