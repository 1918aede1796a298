#include "rebounce/runtime/engine.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "rebounce/runtime/gauss_seidel.h"
#include "rebounce/transfer/error.h"
#include "test_scene_data.h"

namespace {

std::atomic<bool> counting = false;
std::atomic<int> allocation_count = 0;

void* allocate(std::size_t size, std::size_t alignment) {
  if (counting) ++allocation_count;
  void* memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

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
  allocation_count = 0;
  counting = true;
  engine.relight(lights, {});
  counting = false;
  EXPECT_EQ(allocation_count, 0);
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

TEST(Engine, NeedsAnOperator) {
  const auto data = std::make_shared<TransferData>(*two_squares());
  data->transfer = nullptr;
  EXPECT_THROW(Engine{data}, Error);
}

struct GaussSeidelCase {
  std::shared_ptr<const TransferData> data = two_squares();
  FormFactorRows rows{data->exchange, data->patches.area};
  std::vector<Float3> m0 = std::vector<Float3>(data->patches.size(), {1, 2, 3});

  GaussSeidelResult solve(const GaussSeidelSettings& settings, std::vector<Float3>& b) const {
    return solve_gauss_seidel(rows, data->patches.reflectance, data->patches.area, m0, settings, b);
  }
};

TEST(GaussSeidel, SolvesTheEquation) {
  const GaussSeidelCase c;
  std::vector<Float3> b(c.m0.size()), h(c.m0.size());
  const GaussSeidelResult result = c.solve({.residual = 1e-6}, b);
  EXPECT_LE(result.residual, 1e-6);
  EXPECT_GT(result.sweeps, 3);
  c.rows.gather(b, h);
  for (std::size_t i = 0; i < b.size(); ++i) {
    for (int k = 0; k < kChannelCount; ++k) {
      EXPECT_NEAR(b[i][k], c.m0[i][k] + c.data->patches.reflectance[i][k] * h[i][k], 1e-5);
    }
  }
}

TEST(GaussSeidel, WarmStartIsCheaperAndSweepsContract) {
  const GaussSeidelCase c;
  std::vector<Float3> b(c.m0.size());
  const int cold = c.solve({.residual = 1e-5}, b).sweeps;
  EXPECT_EQ(c.solve({.residual = 1e-5}, b).sweeps, 1);
  EXPECT_GT(cold, 1);
  // Contraction per sweep is no worse than the largest reflectance.
  std::vector<Float3> fresh(c.m0.size());
  const double first = c.solve({.max_sweeps = 1, .residual = 0}, fresh).residual;
  const double second = c.solve({.max_sweeps = 1, .residual = 0}, fresh).residual;
  EXPECT_LE(second, 0.9 * first);
}

TEST(GaussSeidel, DoesNotAllocateAndChecksSizes) {
  const GaussSeidelCase c;
  std::vector<Float3> b(c.m0.size());
  allocation_count = 0;
  counting = true;
  c.solve({}, b);
  counting = false;
  EXPECT_EQ(allocation_count, 0);
  b.pop_back();
  EXPECT_THROW(c.solve({}, b), Error);
}

}  // namespace
}  // namespace rebounce
