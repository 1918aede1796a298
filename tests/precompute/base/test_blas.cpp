#include "precompute/base/blas.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <Eigen/Core>
#include <cstdlib>

#include "rebounce/error.h"

namespace rebounce::test_blas {
namespace {

constexpr const char* kKernelVariable = "OPENBLAS_CORETYPE";

/// What depends on the process before the BLAS is loaded is tried in processes of their own.
class Blas : public testing::Test {
 protected:
  Blas() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

bool multiplies() {
  constexpr Eigen::Index kSize = 100;
  const Eigen::MatrixXf a = Eigen::MatrixXf::Constant(kSize, kSize, 0.5F);
  const Eigen::MatrixXf product = a * a;
  return (product.array() == 25.0F).all();
}

bool fits_processor(const std::string& kernels) {
  return better_blas_kernels(kernels, processor_features()).empty();
}

TEST(BlasKernels, AreReplacedWhereTheProcessorIsUnknown) {
  EXPECT_EQ(better_blas_kernels("Prescott", {.avx2_and_fma = true, .avx512 = true}), "SkylakeX");
  EXPECT_EQ(better_blas_kernels("Prescott", {.avx2_and_fma = true}), "Haswell");
}

TEST(BlasKernels, AreReplacedWhereTheProcessorHasWiderVectors) {
  for (const char* narrow : {"Haswell", "Zen"}) {
    EXPECT_EQ(better_blas_kernels(narrow, {.avx2_and_fma = true, .avx512 = true}), "SkylakeX");
    EXPECT_EQ(better_blas_kernels(narrow, {.avx2_and_fma = true}), "");
  }
}

TEST(BlasKernels, AreKeptWhereTheyWillDo) {
  EXPECT_EQ(better_blas_kernels("Prescott", {}), "");
  for (const char* known : {"SkylakeX", "Cooperlake"}) {
    EXPECT_EQ(better_blas_kernels(known, {.avx2_and_fma = true, .avx512 = true}), "") << known;
  }
}

TEST_F(Blas, HasKernelsOfTheProcessor) {
  const auto succeeds = [] {
    unsetenv(kKernelVariable);
    return fits_processor(blas_kernels()) && std::getenv(kKernelVariable) == nullptr &&
           multiplies();
  };
  EXPECT_EXIT(std::exit(succeeds() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST_F(Blas, HasTheKernelsThatAreAskedFor) {
  const auto succeeds = [] {
    setenv(kKernelVariable, "Nehalem", 1);
    return blas_kernels() == "Nehalem" && multiplies();
  };
  EXPECT_EXIT(std::exit(succeeds() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST_F(Blas, IsAnotherThanThatOfTheProcess) {
  const auto succeeds = [] {
    setenv(kKernelVariable, "Prescott", 1);
    void* const other = dlopen("libopenblas.so.0", RTLD_NOW | RTLD_GLOBAL);
    unsetenv(kKernelVariable);
    const auto other_kernels = reinterpret_cast<char* (*)()>(dlsym(other, "openblas_get_corename"));
    return fits_processor(blas_kernels()) && multiplies() &&
           std::string(other_kernels()) == "Prescott";
  };
  EXPECT_EXIT(std::exit(succeeds() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST_F(Blas, ThatCannotBeLoadedIsAnError) {
  const auto succeeds = [] {
    rlimit files;
    getrlimit(RLIMIT_NOFILE, &files);
    const rlimit none = {0, files.rlim_max};
    setrlimit(RLIMIT_NOFILE, &none);
    try {
      load_blas();
    } catch (const Error& error) {
      setrlimit(RLIMIT_NOFILE, &files);  // a sanitizer opens a pipe to look at an object
      return std::string(error.what()).find("install OpenBLAS") != std::string::npos;
    }
    return false;
  };
  EXPECT_EXIT(std::exit(succeeds() ? 0 : 1), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace rebounce::test_blas
