#include "runtime/lights/sky_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <string>

#include "rebounce/error.h"
#include "rebounce/sky.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// Sample points along each side of a cell, for its mean luminance.
constexpr int kPointsAcross = 8;

// ISO 15469:2004, table 1.
constexpr std::array<SkyType, kCieSkyCount> kTypes = {{{4, -0.70, 0, -1, 0},
                                                       {4, -0.70, 2, -1.5, 0.15},
                                                       {1.1, -0.8, 0, -1, 0},
                                                       {1.1, -0.8, 2, -1.5, 0.15},
                                                       {0, -1, 0, -1, 0},
                                                       {0, -1, 2, -1.5, 0.15},
                                                       {0, -1, 5, -2.5, 0.3},
                                                       {0, -1, 10, -3, 0.45},
                                                       {-1, -0.55, 2, -1.5, 0.15},
                                                       {-1, -0.55, 5, -2.5, 0.3},
                                                       {-1, -0.55, 10, -3, 0.45},
                                                       {-1, -0.32, 10, -3, 0.45},
                                                       {-1, -0.32, 16, -3, 0.3},
                                                       {-1, -0.15, 16, -3, 0.3},
                                                       {-1, -0.15, 24, -2.8, 0.15}}};

const SkyType& type_of(int number) {
  if (number < 1 || number > kCieSkyCount) {
    throw Error("there is no CIE sky " + std::to_string(number) + "; ask for 1 to 15");
  }
  return kTypes[static_cast<std::size_t>(number - 1)];
}

}  // namespace

CieSky::CieSky(int type, const glm::dvec3& sun_direction)
    : type_(type_of(type)), to_sun_(-sun_direction) {
  const double length = glm::length(to_sun_);
  if (!(length > 0 && std::isfinite(length)) || (type_.c > 0 && !(to_sun_.y >= 0))) {
    throw Error("the sun of a CIE sky must stand above the horizon: its light travels downwards");
  }
  to_sun_ = glm::normalize(to_sun_);
  zenith_ = indicatrix(to_sun_.y) * gradation(1);
}

double CieSky::luminance(const glm::dvec3& direction) const {
  return indicatrix(glm::dot(direction, to_sun_)) * gradation(direction.y) / zenith_;
}

double CieSky::gradation(double cosine) const {
  return 1 + (cosine > 0 ? type_.a * std::exp(type_.b / cosine) : 0.0);
}

double CieSky::indicatrix(double cosine) const {
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  return 1 + type_.c * (std::exp(type_.d * angle) - std::exp(type_.d * std::numbers::pi / 2)) +
         type_.e * cosine * cosine;
}

SkyDistribution cie_sky(int type, const Float3& sun_direction, float ground_reflectance) {
  const CieSky sky(type, to_dvec3(sun_direction));
  if (!(ground_reflectance >= 0 && ground_reflectance <= 1)) {
    throw Error("the reflectance of the ground must be from 0 to 1");
  }
  SkyDistribution mean{};
  double horizontal = 0;  // horizontal irradiance
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    double sum = 0, received = 0;
    for (int k = 0; k < kPointsAcross * kPointsAcross; ++k) {
      const int row = k / kPointsAcross, column = k % kPointsAcross;
      const Float2 place = {static_cast<float>((row + 0.5) / kPointsAcross),
                            static_cast<float>((column + 0.5) / kPointsAcross)};
      const glm::dvec3 direction = to_dvec3(point_of_sky_cell(cell, place));
      const double luminance = sky.luminance(direction);
      sum += luminance;
      received += luminance * direction.y;
    }
    mean[cell] = static_cast<float>(sum / (kPointsAcross * kPointsAcross));
    horizontal += received / (kPointsAcross * kPointsAcross) * sky_cell_solid_angle(cell);
  }
  mean[0] = static_cast<float>(ground_reflectance * horizontal / std::numbers::pi);
  return mean;
}

}  // namespace rebounce
