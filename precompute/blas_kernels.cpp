#include "rebounce/precompute/blas_kernels.h"

#include <cblas.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace rebounce {
namespace {

constexpr const char* kVariable = "OPENBLAS_CORETYPE";

// What OpenBLAS falls back to.
constexpr std::string_view kOfUnknown = "Prescott";

}  // namespace

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
  if (chosen != kOfUnknown || !features.avx2_and_fma) return {};
  return features.avx512 ? "SkylakeX" : "Haswell";
}

void restart_with_better_blas_kernels(char** arguments) {
  if (std::getenv(kVariable) != nullptr) return;
  const std::string kernels = better_blas_kernels(openblas_get_corename(), processor_features());
  if (kernels.empty() || setenv(kVariable, kernels.c_str(), 0) != 0) return;
  // By its own name, not that of the link, which is what lists of processes would show.
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) execv(program.c_str(), arguments);
}

}  // namespace rebounce
