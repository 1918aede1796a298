#include "runtime/frame/engine.h"

#include <gtest/gtest.h>

#include "tests/support/allocation_counter.h"
#include "tests/support/test_scene_data.h"
#include "transfer/base/error.h"

namespace rebounce {
namespace {

std::shared_ptr<const TransferData> two_squares() {
  auto data = std::make_shared<TransferData>();
  test::add_square(*data, 1, 0, 8, true, {0.5F, 0.4F, 0.3F});
  test::add_square(*data, 1, 2, 8, false, {0.2F, 0.7F, 0.9F});
  data->patches.emitted_exitance[3] = {1, 2, 3};
  test::add_even_exchange(*data);
  return data;
}

Light lamp_at(float x) {
  Light lamp;
  lamp.position = {x, 1, 0.1F};
  lamp.intensity = 10;
  return lamp;
}

std::vector<Float3> copy(std::span<const Float3> values) {
  return {values.begin(), values.end()};
}

TEST(Engine, StagesAddUp) {
  const auto data = two_squares();
  Engine engine(data);
  const Light lamp = lamp_at(0.2F);
  engine.relight({&lamp, 1}, {});
  for (std::size_t i = 0; i < data->patches.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const float rho = data->patches.reflectance[i][c];
      const float m0 =
          rho * engine.direct_irradiance()[i][c] + data->patches.emitted_exitance[i][c];
      EXPECT_FLOAT_EQ(engine.initial_exitance()[i][c], m0);
      EXPECT_FLOAT_EQ(engine.radiosity()[i][c], m0 + rho * engine.indirect_irradiance()[i][c]);
    }
  }
  // The operator of this scene is F: one bounce.
  std::vector<Float3> gathered(data->patches.size());
  FormFactorRows(data->exchange, data->patches.area).gather(engine.initial_exitance(), gathered);
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    EXPECT_NEAR(gathered[i][1], engine.indirect_irradiance()[i][1], 1e-4F * gathered[i][1]);
  }
}

TEST(Engine, AFrameDoesNotAllocate) {
  Engine engine(two_squares());
  const std::vector<Light> lights = {lamp_at(0.1F), lamp_at(-0.4F)};
  engine.relight(lights, {});  // threads and their buffers are made once
  const int count = test::count_allocations([&] { engine.relight(lights, {}); });
  EXPECT_EQ(count, 0);
}

TEST(Engine, ALightMovedAndMovedBackGivesTheSameBits) {
  Engine engine(two_squares());
  const Light here = lamp_at(0.1F), there = lamp_at(0.7F);
  engine.relight({&here, 1}, {});
  const std::vector<Float3> before = copy(engine.radiosity());
  engine.relight({&there, 1}, {});
  EXPECT_NE(before, copy(engine.radiosity()));
  engine.relight({&here, 1}, {});
  EXPECT_EQ(before, copy(engine.radiosity()));
}

TEST(Engine, TakesTheCallersDirectLight) {
  Engine engine(two_squares());
  const Light lamp = lamp_at(0.1F);
  engine.relight({&lamp, 1}, {});
  const std::vector<Float3> own = copy(engine.radiosity()),
                            direct = copy(engine.direct_irradiance());
  engine.relight(direct);
  EXPECT_EQ(own, copy(engine.radiosity()));
  EXPECT_THROW(engine.relight(std::span(direct).first(5)), Error);
}

TEST(Engine, ACopyHasALightStateOfItsOwn) {
  Engine engine(two_squares());
  const Light here = lamp_at(0.1F), there = lamp_at(0.7F);
  engine.relight({&here, 1}, {});
  const std::vector<Float3> before = copy(engine.radiosity());
  Engine second = engine;
  EXPECT_EQ(&second.tracer(), &engine.tracer());
  second.relight({&there, 1}, {});
  EXPECT_EQ(before, copy(engine.radiosity()));
  EXPECT_NE(before, copy(second.radiosity()));
  second.relight({&here, 1}, {});
  EXPECT_EQ(second.direct_lighting().traced_light_count(), 1);
  EXPECT_EQ(before, copy(second.radiosity()));
}

TEST(Engine, EmittersAreScaledByMaterial) {
  const auto data = std::make_shared<TransferData>(*two_squares());
  data->materials.resize(3);
  data->materials[1].emitted_luminance = data->materials[2].emitted_luminance = {1, 1, 1};
  data->mesh.triangle_material[3] = 1;
  data->mesh.triangle_material[5] = 2;
  data->patches.emitted_exitance[5] = {4, 5, 6};
  Engine engine(data);
  engine.relight({}, {});
  const std::vector<Float3> full = copy(engine.radiosity());
  engine.set_emission_scale(1, {0, 0, 0});
  engine.relight({}, {});
  const std::vector<Float3> without = copy(engine.radiosity());
  engine.set_emission_scale(1, {2, 3, 4});
  engine.relight({}, {});
  for (std::size_t i = 0; i < full.size(); ++i) {  // light is linear in what emits
    for (int c = 0; c < kChannelCount; ++c) {
      const auto scale = static_cast<float>(c + 2);
      const float expected = without[i][c] + scale * (full[i][c] - without[i][c]);
      EXPECT_NEAR(engine.radiosity()[i][c], expected, 1e-5F * expected + 1e-7F);
    }
  }
  engine.set_emission_scale(1, {1, 1, 1});
  engine.relight({}, {});
  EXPECT_EQ(full, copy(engine.radiosity()));
  EXPECT_THROW(engine.set_emission_scale(3, {1, 1, 1}), Error);
  EXPECT_THROW(engine.set_emission_scale(1, {1, -1, 1}), Error);
}

TEST(Engine, NeedsAnOperator) {
  const auto data = std::make_shared<TransferData>(*two_squares());
  data->transfer = nullptr;
  EXPECT_THROW(Engine{data}, Error);
}

}  // namespace
}  // namespace rebounce
