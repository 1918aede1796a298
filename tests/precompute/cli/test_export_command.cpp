// `rebounce export` as scripts see it: arrays in NumPy files.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.h"
#include "tests/support/npz_reader.h"

namespace rebounce::test_export_command {
namespace {

using nlohmann::json;
using test::kPatchCount;
using ExportCommand = test::CommandLine;

TEST_F(ExportCommand, ExportsReciprocalFormFactors) {
  summary_of({"export", built("box.safetensors", {"--store-form-factors"}), "--what",
              "form-factors", "-o", path("f.npz")});
  const auto arrays = test::unzip(path("f.npz"));
  const auto form_factor = test::npz_values<double>(arrays, "form_factor", "<f8");
  const auto area = test::npz_values<float>(arrays, "area", "<f4");
  const std::size_t n = area.size();
  ASSERT_EQ(form_factor.size(), n * n);
  std::size_t seeing = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row_sum = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const double there = area[i] * form_factor[i * n + j];
      ASSERT_NEAR(there, area[j] * form_factor[j * n + i], 1e-15) << i << ' ' << j;
      row_sum += form_factor[i * n + j];
    }
    ASSERT_LT(row_sum, 1 + 1e-5);
    if (row_sum > 0.1) ++seeing;
  }
  EXPECT_GT(seeing, n / 2);  // a block stands on some of the others
}

TEST_F(ExportCommand, ExportsTheTransferOfTheFormFactors) {
  const std::string file =
      built("box.safetensors", {"--operator", "dense", "--store-form-factors"});
  summary_of({"export", file, "--what", "form-factors", "-o", path("f.npz")});
  summary_of({"export", file, "--what", "transfer", "-o", path("y.npz")});
  const auto f = test::npz_values<double>(test::unzip(path("f.npz")), "form_factor", "<f8");
  const auto arrays = test::unzip(path("y.npz"));
  const auto y = test::npz_values<float>(arrays, "transfer", "<f4");
  const auto reflectance = test::npz_values<float>(arrays, "reflectance", "<f4");
  const std::size_t n = reflectance.size() / 3;
  ASSERT_EQ(y.size(), 3 * n * n);
  for (std::size_t c = 0; c < 3; ++c) {
    double apart_squared = 0, norm_squared = 0;
    std::vector<double> product(n);
    for (std::size_t i = 0; i < n; ++i) {
      const float* row = y.data() + (c * n + i) * n;
      for (std::size_t j = 0; j < n; ++j) product[j] = row[j];
      for (std::size_t k = 0; k < n; ++k) {
        const double weight = static_cast<double>(row[k]) * reflectance[3 * k + c];
        for (std::size_t j = 0; j < n; ++j) product[j] -= weight * f[k * n + j];
      }
      for (std::size_t j = 0; j < n; ++j) {
        const double apart = product[j] - f[i * n + j];
        apart_squared += apart * apart;
        norm_squared += f[i * n + j] * f[i * n + j];
      }
    }
    // Single precision, and the Cholesky factorisation of a well-conditioned matrix.
    EXPECT_LT(std::sqrt(apart_squared / norm_squared), 1e-6) << "channel " << c;
  }
}

TEST_F(ExportCommand, ExportsPatchesAndMesh) {
  const std::string file = built("box.safetensors");
  const json patches = summary_of({"export", file, "--what", "patches", "-o", path("p.npz")});
  for (const char* name : {"area", "centroid", "normal", "reflectance", "emitted_exitance"}) {
    EXPECT_TRUE(patches["arrays"].contains(name)) << name;
  }
  const auto area = test::npz_values<float>(test::unzip(path("p.npz")), "area", "<f4");
  EXPECT_EQ(patches["arrays"]["area"][0], area.size());
  EXPECT_NEAR(static_cast<double>(area.size()), kPatchCount, 0.2 * kPatchCount);
  const json mesh = summary_of({"export", file, "--what", "mesh", "-o", path("m.npz")});
  EXPECT_EQ(mesh["arrays"]["triangle"][1], 3);
}

}  // namespace
}  // namespace rebounce::test_export_command
