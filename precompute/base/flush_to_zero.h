#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace rebounce {

/// Makes the current thread treat denormal numbers as zero, as operands and as results, for the
/// lifetime of the object. Some processors take a hundred cycles and more for one operation on a
/// denormal number. On other processors than x86-64 nothing changes.
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
