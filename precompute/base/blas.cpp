#include "precompute/base/blas.h"

#include <dlfcn.h>

#include <cstdlib>
#include <memory>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr const char* kKernelVariable = "OPENBLAS_CORETYPE";

// The kernels that OpenBLAS falls back to on a processor that it does not know.
constexpr std::string_view kOfUnknown = "Prescott";

// The kernels for AVX2. OpenBLAS 0.3.21 chooses them on processors of AMD with AVX-512 too, where a
// build is a fifth slower with them (lab/172).
bool is_narrow(std::string_view kernels) {
  return kernels == "Haswell" || kernels == "Zen";
}

struct Close {
  void operator()(void* library) const { dlclose(library); }
};
using Handle = std::unique_ptr<void, Close>;

Handle open(Lmid_t space, const char* name) {
  Handle library(dlmopen(space, name, RTLD_NOW | RTLD_LOCAL));
  if (library == nullptr) {
    throw Error(std::string("cannot load ") + dlerror() + "; install OpenBLAS (libopenblas0)");
  }
  return library;
}

template <typename Function>
Function* find(const Handle& library, const char* name) {
  void* const address = dlsym(library.get(), name);
  if (address == nullptr) throw Error(std::string("not a usable OpenBLAS: ") + dlerror());
  return reinterpret_cast<Function*>(address);
}

/// An instance of OpenBLAS beside any other in the process, with a C library of its own. OpenBLAS
/// chooses its kernels while it is loaded, by the environment of that C library; the environment of
/// the process does not change. It runs on one thread: products are the same on any machine and
/// stay on the calling thread.
class Blas {
 public:
  Blas() {
    const Handle c_library = open(LM_ID_NEWLM, "libc.so.6");
    Lmid_t space = LM_ID_BASE;
    if (dlinfo(c_library.get(), RTLD_DI_LMID, &space) != 0) throw Error(dlerror());
    const auto set = find<int(const char*, const char*, int)>(c_library, "setenv");
    find<int()>(c_library, "clearenv")();
    set("OPENBLAS_NUM_THREADS", "1", 1);
    set("OMP_NUM_THREADS", "1", 1);
    const char* const asked = std::getenv(kKernelVariable);
    if (asked != nullptr) set(kKernelVariable, asked, 1);
    library_ = open(space, "libopenblas.so.0");
    if (asked != nullptr) return;
    const std::string better = better_blas_kernels(kernels(), processor_features());
    if (better.empty()) return;
    library_.reset();
    set(kKernelVariable, better.c_str(), 1);
    library_ = open(space, "libopenblas.so.0");
  }

  std::string kernels() const { return function<char*()>("openblas_get_corename")(); }

  template <typename Function>
  Function* function(const char* name) const {
    return find<Function>(library_, name);
  }

 private:
  Handle library_;
};

const Blas& blas() {
  // This is never closed: other objects may multiply while the program ends.
  static const Blas& blas = *new Blas;
  return blas;
}

}  // namespace

void load_blas() {
  blas();
}

std::string blas_kernels() {
  return blas().kernels();
}

ProcessorFeatures processor_features() {
#if defined(__x86_64__)
  return {.avx2_and_fma = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"),
          .avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")};
#else
  return {};
#endif
}

std::string better_blas_kernels(std::string_view chosen, const ProcessorFeatures& features) {
  const bool unknown = chosen == kOfUnknown;
  if (!features.avx2_and_fma) return {};
  if (features.avx512) return unknown || is_narrow(chosen) ? "SkylakeX" : "";
  return unknown ? "Haswell" : "";
}

}  // namespace rebounce

// The Fortran functions that Eigen calls with EIGEN_USE_BLAS, in single and double precision, and
// one of LAPACK. Fortran passes addresses only. The symbols are hidden, so that a shared library
// does not export them.
using P = const void*;
#define REBOUNCE_FORWARD_AS(name, parameters, ...)                                   \
  extern "C" __attribute__((visibility("hidden"))) void name parameters {            \
    static auto* const function = rebounce::blas().function<void parameters>(#name); \
    function(__VA_ARGS__);                                                           \
  }
#define REBOUNCE_FORWARD(name, parameters, ...)            \
  REBOUNCE_FORWARD_AS(s##name##_, parameters, __VA_ARGS__) \
  REBOUNCE_FORWARD_AS(d##name##_, parameters, __VA_ARGS__)

REBOUNCE_FORWARD(axpy, (P a, P b, P c, P d, P e, P f), a, b, c, d, e, f)
REBOUNCE_FORWARD(gemv, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k), a, b, c, d, e, f, g,
                 h, i, j, k)
REBOUNCE_FORWARD(symv, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j), a, b, c, d, e, f, g, h,
                 i, j)
REBOUNCE_FORWARD(trmv, (P a, P b, P c, P d, P e, P f, P g, P h), a, b, c, d, e, f, g, h)
REBOUNCE_FORWARD(gemm, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k, P l, P m), a, b, c,
                 d, e, f, g, h, i, j, k, l, m)
REBOUNCE_FORWARD(symm, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k, P l), a, b, c, d, e,
                 f, g, h, i, j, k, l)
REBOUNCE_FORWARD(syrk, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j), a, b, c, d, e, f, g, h,
                 i, j)
REBOUNCE_FORWARD(trmm, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k), a, b, c, d, e, f, g,
                 h, i, j, k)
REBOUNCE_FORWARD(trsm, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k), a, b, c, d, e, f, g,
                 h, i, j, k)
REBOUNCE_FORWARD_AS(dsyevd_, (P a, P b, P c, P d, P e, P f, P g, P h, P i, P j, P k), a, b, c, d, e,
                    f, g, h, i, j, k)
