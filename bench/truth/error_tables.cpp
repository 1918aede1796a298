#include "bench/truth/error_tables.h"

#include <initializer_list>
#include <string>
#include <vector>

#include "precompute/base/csv_writer.h"

namespace rebounce::reference {
namespace {

/// A table that grows by rows.
class Rows {
 public:
  /// `scalars`, then three columns for each of `vectors`.
  Rows(std::vector<std::string> scalars, std::initializer_list<std::string> vectors)
      : names_(std::move(scalars)) {
    for (const std::string& vector : vectors) {
      for (const char* axis : {"_0", "_1", "_2"}) names_.push_back(vector + axis);
    }
  }

  void add(std::initializer_list<double> scalars, std::initializer_list<Float3> vectors) {
    for (const double value : scalars) values_.push_back(static_cast<float>(value));
    for (const Float3& v : vectors) values_.insert(values_.end(), v.begin(), v.end());
  }

  void write(const std::filesystem::path& path) const {
    const CsvColumns columns{names_, values_};
    write_csv(path, {&columns, 1});
  }

 private:
  std::vector<std::string> names_;
  std::vector<float> values_;
};

}  // namespace

void write_patch_table(const std::filesystem::path& path, const PatchTable& table,
                       const PatchComparison& compared, std::span<const Float3> indirect_irradiance,
                       const OneBounce& bounce) {
  Rows rows({"patch", "area", "weight", "absorbed"},
            {"centroid", "normal", "reflectance", "h", "truth", "noise", "bounce_traced",
             "bounce_gathered"});
  constexpr Float3 kNothing{0, 0, 0};
  for (std::size_t k = 0; k < compared.patch.size(); ++k) {
    const std::uint32_t i = compared.patch[k];
    rows.add({static_cast<double>(i), table.area[i], compared.weight[k], table.absorbed[i]},
             {table.centroid[i], table.normal[i], table.reflectance[i], indirect_irradiance[i],
              compared.truth[k], compared.standard_error[k],
              bounce.traced.empty() ? kNothing : bounce.traced[i],
              bounce.gathered.empty() ? kNothing : bounce.gathered[i]});
  }
  rows.write(path);
}

void write_point_table(const std::filesystem::path& path, const TransferData& data,
                       std::span<const SurfacePoint> points, const IrradianceEstimate& truth,
                       const ReconstructionComparison& compared) {
  Rows rows({"patch", "triangle", "absorbed"}, {"position", "normal", "shown", "truth", "noise"});
  for (std::size_t k = 0; k < compared.point.size(); ++k) {
    const std::uint32_t p = compared.point[k], t = compared.triangle[k];
    const std::uint32_t patch = data.mesh.triangle_patch[t];
    rows.add({patch == kNone ? -1.0 : patch, static_cast<double>(t), truth.absorbed[p]},
             {points[p].position, points[p].normal, compared.shown[k], truth.mean[p],
              truth.standard_error[p]});
  }
  rows.write(path);
}

}  // namespace rebounce::reference
