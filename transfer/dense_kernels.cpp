#include "dense_kernels.h"

#include <cstring>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include "dense_kernels_impl.h"
#include "half_float.h"

namespace rebounce {
namespace {

/// Four floats in plain C++: SSE2 on x86-64, NEON on AArch64, whatever there is elsewhere.
struct Vector4 {
  static constexpr std::size_t kWidth = 4;
  float v[4];

  static Vector4 load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
  static Vector4 load_half(const std::uint16_t* p) {
    return {{half_to_float(p[0]), half_to_float(p[1]), half_to_float(p[2]), half_to_float(p[3])}};
  }
  static Vector4 zero() { return {{0, 0, 0, 0}}; }
  static Vector4 broadcast(float x) { return {{x, x, x, x}}; }
  void store(float* p) const { std::memcpy(p, v, sizeof v); }
  float sum() const { return (v[0] + v[2]) + (v[1] + v[3]); }
  friend Vector4 multiply_add(const Vector4& a, const Vector4& b, const Vector4& c) {
    return {{a.v[0] * b.v[0] + c.v[0], a.v[1] * b.v[1] + c.v[1], a.v[2] * b.v[2] + c.v[2],
             a.v[3] * b.v[3] + c.v[3]}};
  }
};

#if defined(__x86_64__)
// By hand: __builtin_cpu_supports of Clang before 18 does not know the name.
bool cpu_supports_f16c() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}
#endif

const DenseKernels& pick_dense_kernels() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return kDenseKernelsAvx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && cpu_supports_f16c()) {
    return kDenseKernelsAvx2;
  }
#endif
  return kDenseKernelsPortable;
}

}  // namespace

const DenseKernels kDenseKernelsPortable = make_dense_kernels<Vector4>("portable");

const DenseKernels& dense_kernels() {
  static const DenseKernels& kernels = pick_dense_kernels();
  return kernels;
}

}  // namespace rebounce
