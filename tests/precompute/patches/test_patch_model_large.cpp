// What the patches of large scenes take of memory.

#include <gtest/gtest.h>

#include "precompute/import/import_gltf.h"
#include "precompute/patches/patch_model.h"
#include "tests/support/large_scenes.h"

namespace rebounce::test_patch_model_large {
namespace {

TEST(PatchModelLarge, AMillionInstancedTriangles) {
  const test::TemporaryFolder folder;
  const auto file = test::balls(240, 250, 8, true).write_glb(folder);
  const PatchModel model = make_patch_model(import_gltf(file), {.patch_count = 2000});
  EXPECT_GE(model.scene_triangle_count, 950000U) << "a few slivers at the poles are dropped";
  EXPECT_NEAR(static_cast<double>(model.patches.size()), 2000, 200);
  RecordProperty("peak_gib", std::to_string(test::peak_gib()));
  EXPECT_LT(test::peak_gib(), 0.5) << "seven million are to fit into 4 GiB";
}

}  // namespace
}  // namespace rebounce::test_patch_model_large
