#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bench/report/report_settings.h"
#include "bench/support/form_factor_forms.h"
#include "precompute/build/transfer_build.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce::bench {

/// Called when work begins and during it, with its name and the fraction done; false asks to stop.
using ReportProgress = std::function<bool(std::string_view, double)>;

/// Y in one form.
struct StoredOperator {
  std::string name;  ///< "dense f32", "hierarchical 0.5 %", "low rank 64", ...
  std::shared_ptr<const TransferOperator> transfer;
};

/// "hierarchical 0.5 %"
std::string hierarchical_name(double tolerance);

/// What one phase of the offline stage took.
struct Cost {
  std::string phase;
  double seconds = 0;
  std::size_t bytes = 0;  ///< of what it made; 0: of no interest
};

/// One scene with everything that takes part: the data with a dense operator in f32, which is exact
/// to rounding, every other operator, and every form of F.
struct Contenders {
  std::shared_ptr<const TransferData> data;
  std::unique_ptr<const RayTracer> tracer;
  std::vector<StoredOperator> operators;
  std::vector<Form> forms;  ///< exact ones first
  std::vector<Cost> costs;
  BuildReport report;
  std::size_t peak_memory_bytes = 0;  ///< of the process, when the dense operator was there
  std::size_t file_bytes =
      0;  ///< of a file with operator and compressed F at the default tolerance

  /// Throws Error if there is no such form.
  const std::shared_ptr<const FormFactorOperator>& form(std::string_view name) const;

  /// Throws Error if there is no such operator.
  const std::shared_ptr<const TransferOperator>& transfer(std::string_view name) const;
};

/// Builds them. Throws Error if the scene cannot be used, Cancelled if asked to stop.
Contenders build_contenders(const std::string& scene, const ReportSettings& settings,
                            const ReportProgress& progress);

}  // namespace rebounce::bench
