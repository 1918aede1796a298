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
    _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
  }
  ~FlushToZero() {
    _mm_setcsr(before_);
  }

 private:
  unsigned before_;
#else
  FlushToZero() {}
#endif
};

}  // namespace rebounce
