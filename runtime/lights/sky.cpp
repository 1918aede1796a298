#include "rebounce/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

constexpr std::array<std::uint32_t, 8> kRowCells = {30, 30, 24, 24, 18, 12, 6, 1};
constexpr double kRowHeight = std::numbers::pi / 15;  // 12 degrees; the last row has half of it

struct RowPlace {
  std::size_t row;
  std::uint32_t first;  ///< index of the row's first cell
};

RowPlace row_of(std::uint32_t cell) {
  RowPlace place{0, 1};
  while (cell >= place.first + kRowCells[place.row]) place.first += kRowCells[place.row++];
  return place;
}

/// The sines of the lower and upper altitude of a row.
std::pair<double, double> sines_of(std::size_t row) {
  const double low = kRowHeight * static_cast<double>(row);
  return {std::sin(low), row + 1 < kRowCells.size() ? std::sin(low + kRowHeight) : 1.0};
}

}  // namespace

std::uint32_t sky_cell(const Float3& direction) {
  const auto [x, y, z] = direction;
  if (!(y >= 0)) return 0;
  const double altitude = std::asin(std::min(1.0F, y));
  const auto wanted =
      std::min(static_cast<std::size_t>(altitude / kRowHeight), kRowCells.size() - 1);
  std::uint32_t first = 1;
  for (std::size_t row = 0; row < wanted; ++row) first += kRowCells[row];
  const double count = kRowCells[wanted];
  const double turns =
      std::atan2(x, -z) / (2 * std::numbers::pi) + 1;  // from north, clockwise; in [0.5, 1.5]
  return first + static_cast<std::uint32_t>(std::lround(turns * count)) % kRowCells[wanted];
}

Float3 point_of_sky_cell(std::uint32_t cell, const Float2& place) {
  const auto [row, first] = row_of(cell);
  const auto [low, high] = sines_of(row);
  const double y = low + (high - low) * place[0], r = std::sqrt(std::max(0.0, 1 - y * y));
  const double azimuth = 2 * std::numbers::pi * (cell - first + place[1] - 0.5) / kRowCells[row];
  return {static_cast<float>(r * std::sin(azimuth)), static_cast<float>(y),
          static_cast<float>(-r * std::cos(azimuth))};
}

float sky_cell_solid_angle(std::uint32_t cell) {
  if (cell == 0) return static_cast<float>(2 * std::numbers::pi);
  const std::size_t row = row_of(cell).row;
  const auto [low, high] = sines_of(row);
  return static_cast<float>(2 * std::numbers::pi * (high - low) / kRowCells[row]);
}

}  // namespace rebounce
