#pragma once

// A triangle that a test changes and imports.

#include <gtest/gtest.h>

#include "precompute/import/import_gltf.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test {

/// Fails the test where a component is off by more than the rounding of single precision.
inline void expect_near(const Float3& actual, const Float3& expected, double tolerance = 1e-6) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance);
}

class ImportedTriangle : public testing::Test {
 protected:
  Scene import(const GltfBuilder& builder) { return import_gltf(builder.write_glb(folder_)); }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

}  // namespace rebounce::test
