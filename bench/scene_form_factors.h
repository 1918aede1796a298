#pragma once

#include <string>
#include <vector>

#include "bench/asked_table.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce::bench {

/// Measures the form factors of a scene from a file.
class SceneFormFactors {
 public:
  /// `report` must outlive it. Throws Error if the scene cannot be used.
  SceneFormFactors(const std::string& path, std::size_t patch_count, AskedTable& report);

  /// How exact each quality is: against `reference_factor` times the rays of the default one.
  void measure_convergence(int reference_factor);

  /// How fast the default quality is beside bare Embree, for which at most `ray_limit` rays lie
  /// ready; from minima of `repeats`.
  void measure_speed(double ray_limit, int repeats);

 private:
  const std::vector<float>& area() const { return model_.patches.area; }
  void add(const char* quality, const std::string& measure, double value, double asked = 0);
  std::vector<double> smooth_light() const;
  void measure_ranks(const std::vector<std::vector<double>>& matrices);

  std::string name_;
  AskedTable& report_;
  PatchModel model_;
  RayTracer tracer_;
};

}  // namespace rebounce::bench
