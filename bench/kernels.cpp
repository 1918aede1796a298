// The innermost kernels by themselves, on data in the nearest cache.

#include <benchmark/benchmark.h>

#include <array>
#include <random>
#include <string>

#include "bench/machine.h"
#include "precompute/exchange/pairs/form_factor_kernel.h"
#include "transfer/base/half_float.h"
#include "transfer/kernels/kernels.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce::bench {
namespace {

constexpr std::size_t kTile = DenseOperator::kTile;

std::vector<float> random_values(std::size_t count) {
  std::mt19937 engine(1);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(engine()) * 0x1p-32F;
  return values;
}

/// Pairs of right triangles with unit legs that face each other at `distance`, turned about so that
/// no two pairs are alike.
std::vector<std::array<FlatTriangle, 2>> facing_triangles(double distance) {
  constexpr std::size_t kPairCount = 256;
  std::mt19937 engine(1);
  const auto random = [&engine] { return 0.1 * (engine() * 0x1p-32 - 0.5); };
  const auto near_point = [&](double x, double y, double z) {
    return glm::dvec3(x + random(), y + random(), z + random());
  };
  std::vector<std::array<FlatTriangle, 2>> pairs;
  for (std::size_t k = 0; k < kPairCount; ++k) {
    pairs.push_back({FlatTriangle(near_point(0, 0, 0), near_point(1, 0, 0), near_point(0, 1, 0)),
                     FlatTriangle(near_point(0, 0, distance), near_point(0, 1, distance),
                                  near_point(1, 0, distance))});
  }
  return pairs;
}

template <typename Kernel>
void time_pairs(benchmark::State& state, double distance, const Kernel& kernel) {
  const auto pairs = facing_triangles(distance);
  for ([[maybe_unused]] auto _ : state) {
    for (const auto& [a, b] : pairs) benchmark::DoNotOptimize(kernel(a, b));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(pairs.size()));
}

double unoccluded(const FlatTriangle& a, const FlatTriangle& b) {
  return unoccluded_exchange_area(a, b);
}

BENCHMARK_CAPTURE(time_pairs, can_exchange, 1, can_exchange)->Name("can_exchange");
BENCHMARK_CAPTURE(time_pairs, contour, 1, contour_exchange_area)->Name("contour_exchange_area");

// The distances make it choose the contour integral, degree 5 and degree 2.
BENCHMARK_CAPTURE(time_pairs, near, 1, unoccluded)->Name("unoccluded_exchange_area/near");
BENCHMARK_CAPTURE(time_pairs, degree_5, 5, unoccluded)->Name("unoccluded_exchange_area/degree_5");
BENCHMARK_CAPTURE(time_pairs, degree_2, 20, unoccluded)->Name("unoccluded_exchange_area/degree_2");

template <typename Value>
void time_product(benchmark::State& state, const TileKernels<Value>& kernels, bool diagonal) {
  const std::vector<float> values = random_values(kTile * kTile);
  std::vector<Value> tile(values.begin(), values.end());
  if constexpr (sizeof(Value) == sizeof(std::uint16_t)) tile = DenseOperator::encode_half(values);
  const std::vector<float> x = random_values(2 * kTile);
  std::vector<float> y(2 * kTile);
  for ([[maybe_unused]] auto _ : state) {
    if (diagonal) {
      kernels.diagonal(tile.data(), x.data(), y.data());
    } else {
      kernels.off_diagonal(tile.data(), x.data(), x.data() + kTile, y.data(), y.data() + kTile);
    }
    benchmark::ClobberMemory();
  }
  const auto bytes = static_cast<std::int64_t>(kTile * kTile * sizeof(Value));
  state.SetBytesProcessed(state.iterations() * bytes);
}

/// Arguments: which instruction set, and whether half precision and a tile on the diagonal.
void time_tile(benchmark::State& state) {
  const KernelSet& set = *kernel_sets()[static_cast<std::size_t>(state.range(0))];
  state.SetLabel(set.instruction_set);
  const bool half = state.range(1) != 0, diagonal = state.range(2) != 0;
  if (half) {
    time_product(state, set.dense.f16, diagonal);
  } else {
    time_product(state, set.dense.f32, diagonal);
  }
}
BENCHMARK(time_tile)
    ->Name("tile")
    ->ArgNames({"set", "f16", "diagonal"})
    ->ArgsProduct(
        {benchmark::CreateDenseRange(0, static_cast<std::int64_t>(kernel_sets().size()) - 1, 1),
         {0, 1},
         {0, 1}});

void time_float_to_half(benchmark::State& state) {
  const std::vector<float> values = random_values(kTile * kTile);
  std::vector<std::uint16_t> half(values.size());
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t k = 0; k < values.size(); ++k) half[k] = float_to_half(values[k]);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(values.size()));
}
BENCHMARK(time_float_to_half)->Name("float_to_half");

void time_half_to_float(benchmark::State& state) {
  const std::vector<std::uint16_t> half = DenseOperator::encode_half(random_values(kTile * kTile));
  std::vector<float> values(half.size());
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t k = 0; k < half.size(); ++k) values[k] = half_to_float(half[k]);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(half.size()));
}
BENCHMARK(time_half_to_float)->Name("half_to_float");

void describe_run() {
  const Machine machine = describe_machine();
  benchmark::AddCustomContext("processor", machine.processor);
  benchmark::AddCustomContext("compiler", machine.compiler);
  benchmark::AddCustomContext("build_type", machine.build_type);
  benchmark::AddCustomContext("commit", machine.commit);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  rebounce::bench::describe_run();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
