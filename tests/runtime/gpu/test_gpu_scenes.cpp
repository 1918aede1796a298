#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "rebounce/build_settings.h"
#include "runtime/outputs/vertex_light.h"
#include "tests/runtime/gpu/gpu_frame.h"
#include "tests/support/built_scene.h"
#include "transfer/base/reflection.h"

namespace rebounce::test_gpu_scenes {
namespace {

class GpuScenes : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Shipped, GpuScenes,
                         testing::Values("cornell_box", "furnished_room", "pavilion", "three_rooms",
                                         "two_rooms", "white_room"),
                         [](const auto& instance) { return std::string(instance.param); });

/// Y M0 by plain sums over the stored operator.
std::vector<Float3> exact_irradiance(const Engine& engine) {
  const std::size_t n = engine.radiosity().size();
  std::vector<Float3> irradiance(n);
  std::vector<float> transfer(n * n);
  for (int c = 0; c < kChannelCount; ++c) {
    engine.data().transfer->expand(c, transfer);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j)
        sum += double{transfer[i * n + j]} * engine.initial_exitance()[j][c];
      irradiance[i][c] = static_cast<float>(sum);
    }
  }
  return irradiance;
}

// A lamp in the middle of the scene, and a dim sky: patches of full light beside dark ones.
TEST_P(GpuScenes, GiveTheLightOfTheStoredOperator) {
  const test::GlContext context;
  if (!context.is_current()) GTEST_SKIP() << "there is no OpenGL 4.3 on this machine";
  BuildSettings settings;
  settings.subdivision.patch_count = 600;
  const auto data = std::make_shared<const TransferData>(
      test::built_scene(std::string(GetParam()) + ".gltf", settings));
  Light lamp;
  lamp.intensity = 100;
  for (const Float3& centroid : data->patches.centroid) {
    for (int c = 0; c < 3; ++c) {
      lamp.position[c] += centroid[c] / static_cast<float>(data->patches.size());
    }
  }
  Engine engine(data);
  engine.relight({&lamp, 1}, {.luminance = 1});
  GpuEngine gpu(data, eglGetProcAddress);
  const test::FrameBuffers buffers(*data, engine.direct_irradiance());
  gpu.relight(buffers.names());

  // The card has the stored values, and rounds sums of floats alone.
  constexpr double kOfFloats = 1e-4;
  const std::vector<Float3> exact = exact_irradiance(engine), indirect = buffers.indirect.read(),
                            radiosity = buffers.radiosity.read();
  std::vector<Float3> exact_radiosity(exact.size()), exact_vertices(data->mesh.position.size());
  add_reflected(engine.initial_exitance(), data->patches.reflectance, exact, exact_radiosity);
  light_at_vertices(data->mesh, exact, exact_vertices);
  EXPECT_LE(test::largest_difference(exact, indirect), kOfFloats);
  EXPECT_LE(test::largest_difference(exact_radiosity, radiosity), kOfFloats);
  EXPECT_LE(test::largest_difference(exact_vertices, buffers.vertices.read()), kOfFloats);

  // The processor rounds the light to integers too.
  constexpr double kOfLight = 1e-3;
  EXPECT_LE(test::largest_difference(engine.indirect_irradiance(), indirect), kOfLight);
  EXPECT_LE(test::largest_difference(engine.radiosity(), radiosity), kOfLight);
}

}  // namespace
}  // namespace rebounce::test_gpu_scenes
