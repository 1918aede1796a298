#include "runtime/frame/engine_parts.h"

#include <gtest/gtest.h>

#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_engine {
namespace {

/// Two squares, of which one patch emits.
std::shared_ptr<const TransferData> lit_squares() {
  const auto data = test::facing_squares();
  data->patches.emitted_exitance[3] = {1, 2, 3};
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
  const auto data = lit_squares();
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
  Engine engine(lit_squares());
  const std::vector<Light> lights = {lamp_at(0.1F), lamp_at(-0.4F)};
  engine.relight(lights, {});  // threads and their buffers are made once
  const int count = test::count_allocations([&] { engine.relight(lights, {}); });
  EXPECT_EQ(count, 0);
}

TEST(Engine, ALightMovedAndMovedBackGivesTheSameBits) {
  Engine engine(lit_squares());
  const Light here = lamp_at(0.1F), there = lamp_at(0.7F);
  engine.relight({&here, 1}, {});
  const std::vector<Float3> before = copy(engine.radiosity());
  engine.relight({&there, 1}, {});
  EXPECT_NE(before, copy(engine.radiosity()));
  engine.relight({&here, 1}, {});
  EXPECT_EQ(before, copy(engine.radiosity()));
}

TEST(Engine, TakesTheCallersDirectLight) {
  Engine engine(lit_squares());
  const Light lamp = lamp_at(0.1F);
  engine.relight({&lamp, 1}, {});
  const std::vector<Float3> own = copy(engine.radiosity()),
                            direct = copy(engine.direct_irradiance());
  engine.relight(direct);
  EXPECT_EQ(own, copy(engine.radiosity()));
  EXPECT_THROW(engine.relight(std::span(direct).first(5)), Error);
}

TEST(Engine, LightThatIsNoneIsRefusedAndTheLastFrameStays) {
  Engine engine(lit_squares());
  const Light lamp = lamp_at(0.1F);
  const Sky sky = {{1, 1, 1}, 3};
  engine.relight({&lamp, 1}, sky);
  const std::vector<Float3> good = copy(engine.direct_irradiance()),
                            indirect = copy(engine.indirect_irradiance()),
                            radiosity = copy(engine.radiosity());
  const auto expect_unchanged = [&] {
    EXPECT_EQ(good, copy(engine.direct_irradiance()));
    EXPECT_EQ(indirect, copy(engine.indirect_irradiance()));
    EXPECT_EQ(radiosity, copy(engine.radiosity()));
    EXPECT_EQ(engine.sky().luminance, 3);
  };
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e-6F}) {
    std::vector<Float3> direct = good;
    direct[7][1] = bad;
    test::expect_error([&] { engine.relight(direct); }, "patch 7 is negative or not finite");
    expect_unchanged();
    Light bad_lamp = lamp;
    bad_lamp.intensity = bad;
    const std::array<Light, 2> lamps = {lamp_at(0.7F), bad_lamp};
    test::expect_error([&] { engine.relight(lamps, {}); }, "light 1: a light's intensity");
    expect_unchanged();
    test::expect_error([&] { engine.relight({&lamp, 1}, {.luminance = bad}); }, "sky");
    expect_unchanged();
  }
}

TEST(Engine, LightThatSumsCannotTakeIsRefusedAndTheLastFrameStays) {
  Engine engine(lit_squares());
  Light lamp = lamp_at(0.1F);
  engine.relight({&lamp, 1}, {});
  const std::vector<Float3> good = copy(engine.direct_irradiance()),
                            radiosity = copy(engine.radiosity());
  const auto expect_refused = [&](const auto& call, const char* message) {
    test::expect_error(call, message);
    EXPECT_EQ(good, copy(engine.direct_irradiance()));
    EXPECT_EQ(radiosity, copy(engine.radiosity()));
    EXPECT_EQ(engine.sky().luminance, 0);
  };
  Light bright = lamp_at(0.7F);
  for (const float intensity : {1e33F, 1e38F, std::numeric_limits<float>::max()}) {
    bright.intensity = intensity;
    const std::array<Light, 3> lamps = {lamp, bright, lamp};
    expect_refused([&] { engine.relight(lamps, {}); }, "light 1 is too bright: the direct irrad");
  }
  const Sky sky = {{1, 1, 1}, 1e32F};
  expect_refused([&] { engine.relight({&lamp, 1}, sky); }, "the sky is too bright");
  std::vector<Float3> direct = good;
  direct[7][1] = 2e30F;
  expect_refused([&] { engine.relight(direct); }, "patch 7 is above 1e30 lx");
}

TEST(Engine, LightUpToTheLimitScales) {
  const auto data = std::make_shared<TransferData>(*lit_squares());
  std::ranges::fill(data->patches.emitted_exitance, Float3{0, 0, 0});
  Engine engine(data);
  std::vector<Float3> direct(data->patches.size(), Float3{1, 0.5F, 0.25F});
  engine.relight(direct);
  const std::vector<Float3> expected = copy(engine.radiosity());
  constexpr float kScale = 0x1p99F;  // rounding is the same for powers of two
  for (Float3& e : direct) e = {kScale * e[0], kScale * e[1], kScale * e[2]};
  engine.relight(direct);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      EXPECT_EQ(engine.radiosity()[i][c], kScale * expected[i][c]);
    }
  }
}

TEST(Engine, OutputsOfAnotherSizeAreRefused) {
  Engine engine(lit_squares());
  engine.relight(std::vector<Float3>(engine.radiosity().size(), {1, 1, 1}));
  std::vector<Float3> values(engine.data().mesh.position.size() + 1);
  EXPECT_THROW(vertex_irradiance(engine, values), Error);
  EXPECT_NO_THROW(vertex_irradiance(engine, std::span(values).first(values.size() - 1)));
  std::vector<ProbeLight> probes(1);
  EXPECT_THROW(probe_light(engine, probes), Error);
  std::vector<SurfaceLight> light(values.size() - 1);
  test::expect_error([&] { vertex_light(engine, light); }, "--surface-harmonics");
  test::expect_error([&] { lightmap_irradiance(engine, values); }, "--lightmap");
}

TEST(Engine, ACopyHasALightStateOfItsOwn) {
  Engine engine(lit_squares());
  const Light here = lamp_at(0.1F), there = lamp_at(0.7F);
  engine.relight({&here, 1}, {});
  const std::vector<Float3> before = copy(engine.radiosity());
  Engine second = engine;
  EXPECT_EQ(second.parts().tracer, engine.parts().tracer);
  second.relight({&there, 1}, {});
  EXPECT_EQ(before, copy(engine.radiosity()));
  EXPECT_NE(before, copy(second.radiosity()));
  second.relight({&here, 1}, {});
  EXPECT_EQ(second.parts().direct_lighting->traced_light_count(), 1);
  EXPECT_EQ(before, copy(second.radiosity()));
}

TEST(Engine, EmittersAreScaledByMaterial) {
  const auto data = std::make_shared<TransferData>(*lit_squares());
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
  test::expect_error([&] { engine.set_emission_scale(2, {3e38F, 1, 1}); }, "not finite");
  test::expect_error([&] { engine.set_emission_scale(2, {1e30F, 1, 1}); }, "above 1e30 lx");
  engine.relight({}, {});
  EXPECT_EQ(full, copy(engine.radiosity())) << "nothing is scaled";
}

TEST(Engine, NeedsAnOperator) {
  const auto data = std::make_shared<TransferData>(*lit_squares());
  data->transfer = nullptr;
  EXPECT_THROW(Engine{data}, Error);
}

}  // namespace
}  // namespace rebounce::test_engine
