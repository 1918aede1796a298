#include "bench/report/report_settings.h"

namespace rebounce::bench {

void ReportSettings::make_quick() {
  operators = {{0.005, Precision::kQ8}, {0.001, Precision::kQ8}};
  form_factor_tolerances = {0.0003, 0.001};
  ranks = {64};
  lamp_count = 2;
  motions = {0.001, 0.01, 0.05};
  sweeps = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 48};
  repeats = 3;
  frame_count = 60;
  patch_comparison = {.patch_count = 500, .points_per_patch = 32, .samples_per_point = 16};
  truth_point_count = 2000;
  truth_samples = 64;
  picture_width = 320;
  picture_height = 240;
}

void ReportSettings::make_large() {
  operators = {{0.005, Precision::kQ8},
               {0.02, Precision::kQ8},
               {0.002, Precision::kQ8},
               {0.001, Precision::kQ8},
               {0.0003, Precision::kQ8}};
  form_factor_tolerances = {0.0003, 0.001, 0.003};
  ranks = {256};
  lamp_count = 2;
  motions = {0.001, 0.01, 0.05};
  sweeps = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24};
  repeats = 5;
}

void ReportSettings::make_huge() {
  operators = {{0.005, Precision::kQ8}, {0.002, Precision::kQ8}, {0.001, Precision::kQ8}};
  form_factor_tolerances = {0.0003, 0.0005, 0.001};
  motions = {0.001, 0.01};
  sweeps = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16};
  repeats = 3;
  truth_probe_rays = 16;
}

}  // namespace rebounce::bench
