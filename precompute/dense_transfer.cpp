#include "rebounce/precompute/dense_transfer.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "rebounce/transfer/area_norm.h"
#include "tiled_cholesky.h"

namespace rebounce {
namespace {

constexpr double kReflectanceFloor = 1e-7;
constexpr std::size_t kTile = DenseOperator::kTile;

std::vector<double> root_reflectance(const PatchTable& patches, int channel) {
  std::vector<double> root;
  root.reserve(patches.size());
  for (const Float3& rho : patches.reflectance) {
    root.push_back(std::sqrt(std::max<double>(rho[channel], kReflectanceFloor)));
  }
  return root;
}

/// I - R G R.
void fill_system(const ExchangeMatrix& exchange, const PatchTable& patches,
                 const std::vector<double>& root, TiledMatrix& system) {
  const std::size_t n = patches.size();
  for (std::size_t i = 0; i < n; ++i) {
    system.at(i, i) += 1;
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::size_t j = exchange.column[k];
      const double g = exchange.exchange_area[k] /
                       std::sqrt(static_cast<double>(patches.area[i]) * patches.area[j]);
      const double value = -root[i] * g * root[j];
      if (i == j) {
        system.at(i, i) += value;
        continue;
      }
      system.at(j, i) = value;
      if (j / TiledMatrix::kTile == i / TiledMatrix::kTile) system.at(i, j) = value;
    }
  }
}

/// Writes Yhat = R^-1 (inverse - I) R^-1 as the operator's tiles.
void write_tiles(TiledMatrix& inverse, const std::vector<double>& root, float* tiles) {
  const std::size_t n = root.size(), side = (n + kTile - 1) / kTile;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t tile_row = 0; tile_row < side; ++tile_row) {
    float* tile = tiles + tile_row * (tile_row + 1) / 2 * kTile * kTile;
    for (std::size_t tile_column = 0; tile_column <= tile_row; ++tile_column) {
      for (std::size_t r = 0; r < kTile; ++r) {
        for (std::size_t c = 0; c < kTile; ++c, ++tile) {
          const std::size_t i = tile_row * kTile + r, j = tile_column * kTile + c;
          if (i >= n || j >= n) continue;
          const double p = inverse.at(std::max(i, j), std::min(i, j)) - (i == j ? 1.0 : 0.0);
          *tile = static_cast<float>(p / (root[i] * root[j]));
        }
      }
    }
  }
}

}  // namespace

std::uint32_t distinct_channels(std::span<const Float3> reflectance,
                                std::array<std::uint32_t, kChannelCount>& channel_matrix) {
  const auto same = [&](int a, int b) {
    return std::ranges::all_of(reflectance, [=](const Float3& rho) { return rho[a] == rho[b]; });
  };
  std::uint32_t count = 0;
  for (int c = 0; c < kChannelCount; ++c) {
    int earlier = 0;
    while (earlier < c && !same(earlier, c)) ++earlier;
    channel_matrix[c] = earlier < c ? channel_matrix[earlier] : count++;
  }
  return count;
}

std::uint32_t distinct_channels(std::span<const Float3> reflectance) {
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  return distinct_channels(reflectance, channel_matrix);
}

std::size_t dense_transfer_peak_bytes(std::size_t patch_count, std::size_t matrix_count) {
  const std::size_t tiles =
      DenseOperator::tile_count(patch_count) * kTile * kTile * sizeof(float) * matrix_count;
  return TiledMatrix::bytes(patch_count) + tiles;
}

std::shared_ptr<const DenseOperator> build_dense_transfer(const ExchangeMatrix& exchange,
                                                          const PatchTable& patches,
                                                          Precision precision,
                                                          const Progress& progress) {
  DenseOperator::Storage storage;
  storage.area = patches.area;
  storage.precision = precision;
  storage.matrix_count = distinct_channels(patches.reflectance, storage.channel_matrix);
  const std::size_t matrix_values = DenseOperator::tile_count(patches.size()) * kTile * kTile;
  std::vector<float> tiles(storage.matrix_count * matrix_values, 0.0F);
  for (std::uint32_t matrix = 0; matrix < storage.matrix_count; ++matrix) {
    const auto channel = static_cast<int>(std::ranges::find(storage.channel_matrix, matrix) -
                                          storage.channel_matrix.begin());
    const std::vector<double> root = root_reflectance(patches, channel);
    TiledMatrix system(patches.size());
    fill_system(exchange, patches, root, system);
    Progress part;
    if (progress) {
      part = [&](double done) { return progress((matrix + done) / storage.matrix_count); };
    }
    invert_positive_definite(system, part);
    write_tiles(system, root, tiles.data() + matrix * matrix_values);
  }
  if (precision == Precision::kF16) {
    storage.tiles_f16 = SharedArray(DenseOperator::encode_half(tiles));
  } else {
    storage.tiles_f32 = SharedArray(std::move(tiles));
  }
  return std::make_shared<const DenseOperator>(std::move(storage));
}

double transfer_residual(const TransferOperator& transfer, const FormFactorOperator& form_factors,
                         const PatchTable& patches) {
  constexpr int kProbeCount = 4;
  const std::size_t n = patches.size();
  std::vector<Float3> v(n), fv(n), w(n), result(n);
  std::vector<float> workspace(std::max(transfer.workspace_size(), form_factors.workspace_size()));
  std::mt19937 engine(1);
  double largest = 0;
  for (int probe = 0; probe < kProbeCount; ++probe) {
    for (Float3& value : v) {
      for (float& x : value) x = static_cast<float>(engine() * 0x1p-32);
    }
    form_factors.gather(v, fv, workspace);
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < kChannelCount; ++c)
        w[i][c] = v[i][c] - patches.reflectance[i][c] * fv[i][c];
    }
    transfer.apply(w, result, workspace);
    largest = std::max(largest, relative_difference(result, fv, patches.area));
  }
  return largest;
}

double transfer_residual(const TransferOperator& transfer, const ExchangeMatrix& exchange,
                         const PatchTable& patches) {
  return transfer_residual(transfer, FormFactorRows(exchange, patches.area), patches);
}

}  // namespace rebounce
