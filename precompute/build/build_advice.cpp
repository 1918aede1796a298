#include "precompute/build/build_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {
namespace {

constexpr double kLongSeconds = 60;  // shorter builds need no advice about time
constexpr double kMostOfTheTime = 0.75;
constexpr double kManyBytes = 1000;  // per patch; lab/045, lab/056: twice those of most scenes
constexpr double kHighReflectance = 0.9;
constexpr double kManyMixed = 1.0 / 3;

double seconds_of(const BuildReport& report, std::string_view phase) {
  double sum = 0;
  for (const auto& [name, seconds] : report.seconds) {
    if (phase.empty() || name == phase) sum += seconds;
  }
  return sum;
}

/// Over the area of all patches and the three channels.
double mean_reflectance(const PatchTable& patches) {
  double sum = 0, area = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto& [r, g, b] = patches.reflectance[i];
    sum += patches.area[i] * (static_cast<double>(r) + g + b) / 3;
    area += patches.area[i];
  }
  return area > 0 ? sum / area : 0;
}

/// The number of patches whose triangles have more than one material.
std::size_t mixed_count(const DisplayMesh& mesh, std::size_t patch_count) {
  std::vector<std::uint32_t> material(patch_count, kNone);
  std::vector<bool> is_mixed(patch_count);
  for (std::size_t t = 0; t < mesh.triangle_patch.size(); ++t) {
    const std::uint32_t i = mesh.triangle_patch[t];
    if (i == kNone) continue;
    if (material[i] != kNone && material[i] != mesh.triangle_material[t]) is_mixed[i] = true;
    material[i] = mesh.triangle_material[t];
  }
  return static_cast<std::size_t>(std::ranges::count(is_mixed, true));
}

}  // namespace

std::vector<std::string> build_advice(const TransferData& data, const BuildReport& report) {
  std::vector<std::string> advice;
  const double seconds = seconds_of(report, ""),
               in_form_factors = seconds_of(report, "form factors") +
                                 seconds_of(report, "finer links") +
                                 seconds_of(report, "check of links");
  if (seconds > kLongSeconds && in_form_factors > kMostOfTheTime * seconds) {
    advice.push_back(
        fmt::format("form factors took {:.0f} % of the time; for a first look, --quality low or "
                    "fewer --patches take a third of it",
                    100 * in_form_factors / seconds));
  }
  const std::size_t n = data.patches.size();
  const double bytes = static_cast<double>(data.transfer->bytes()) /
                       static_cast<double>(std::max<std::size_t>(n, 1));
  const auto* const blocks = dynamic_cast<const HierarchicalOperator*>(data.transfer.get());
  if (blocks != nullptr && bytes > kManyBytes) {
    const bool in_8_bits = are_integers(blocks->storage().precision.bases);
    advice.push_back(
        fmt::format("{:.0f} bytes per patch are many, as much is seen in part only; a larger "
                    "--tolerance,{} --receivers or --sources take fewer",
                    bytes, in_8_bits ? "" : " --precision q8,"));
  }
  if (const double reflectance = mean_reflectance(data.patches); reflectance > kHighReflectance) {
    advice.push_back(
        fmt::format("surfaces reflect {:.0f} % in the mean, so that errors of form factors add up "
                    "over many bounces; --quality high has smaller ones (white paint reflects "
                    "about 80 %)",
                    100 * reflectance));
  }
  if (const std::size_t mixed = mixed_count(data.mesh, n);
      static_cast<double>(mixed) > kManyMixed * static_cast<double>(n)) {
    advice.push_back(
        fmt::format("{} of {} patches mix materials, and send on light of their mean colour; more "
                    "--patches part them",
                    mixed, n));
  }
  return advice;
}

}  // namespace rebounce
