#include "bench/report/report_settings.h"

namespace rebounce::bench {

void ReportSettings::make_quick() {
  tolerances = {0.001, kDefaultTolerance};
  refined_tolerances = {kDefaultTolerance};
  ranks = {64};
  lamp_count = 5;
  motions = {0.001, 0.01, 0.05};
  repeats = 3;
  frame_count = 60;
  patch_comparison = {.patch_count = 500, .points_per_patch = 32, .samples_per_point = 16};
  truth_point_count = 2000;
  truth_samples = 64;
  picture_width = 320;
  picture_height = 240;
}

void ReportSettings::make_large() {
  ranks = {256};
  motions = {0.001, 0.01, 0.05};
  repeats = 5;
  frame_count = 120;
}

void ReportSettings::make_huge() {
  tolerances = {0.0003, 0.001, 0.002, kDefaultTolerance};
  refined_tolerances = {kDefaultTolerance};
  lamp_count = 16;
  motions = {0.01};
  repeats = 3;
  frame_count = 60;
  truth = false;
}

}  // namespace rebounce::bench
