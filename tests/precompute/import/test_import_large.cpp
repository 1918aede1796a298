// What the import of large scenes takes of memory.

#include <gtest/gtest.h>

#include "precompute/import/import_gltf.h"
#include "tests/support/large_scenes.h"

namespace rebounce::test_import_large {
namespace {

double peak_of_import(const test::GltfBuilder& builder, std::size_t triangles) {
  test::TemporaryFolder folder;
  const Scene scene = import_gltf(builder.write_glb(folder));
  EXPECT_EQ(scene.triangle.size(), triangles);
  return test::peak_gib();
}

// The order matters: the peak of a process never sinks.

TEST(ImportLarge, FourHundredThousandTrianglesInOneMesh) {
  EXPECT_LT(peak_of_import(test::balls(400, 500, 1, true), 400000), 0.5);
}

TEST(ImportLarge, SevenMillionInstancedTriangles) {
  const double peak = peak_of_import(test::balls(50, 70, 1000, true), 7000000);
  RecordProperty("peak_gib", std::to_string(peak));
  EXPECT_LT(peak, 1.5);
}

TEST(ImportLarge, SevenMillionInstancedTrianglesWithoutSharedVertices) {
  const double peak = peak_of_import(test::balls(50, 70, 1000, false), 7000000);
  RecordProperty("peak_gib", std::to_string(peak));
  EXPECT_LT(peak, 2.5);
}

}  // namespace
}  // namespace rebounce::test_import_large
