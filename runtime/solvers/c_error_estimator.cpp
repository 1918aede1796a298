// rebounce.h: the error of a frame.

#include "rebounce/solvers.h"
#include "runtime/frame/c_handles.h"

// NOLINTBEGIN(readability-identifier-naming): the names of a C interface

struct rebounce_error_estimator {
  rebounce::ErrorEstimator estimator;
};

// NOLINTEND(readability-identifier-naming)

namespace rebounce::c {

extern "C" {

rebounce_status rebounce_error_estimator_create(rebounce_transfer* transfer,
                                                rebounce_error_estimator** estimator) {
  clear(estimator);
  if (transfer == nullptr || estimator == nullptr) {
    return missing("rebounce_error_estimator_create");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    *estimator = new rebounce_error_estimator{ErrorEstimator(transfer->data)};
    return REBOUNCE_OK;
  });
}

void rebounce_error_estimator_destroy(rebounce_error_estimator* estimator) {
  delete estimator;
}

rebounce_status rebounce_engine_estimate_error(const rebounce_engine* engine,
                                               rebounce_error_estimator* estimator, double* error,
                                               double* bound) {
  if (engine == nullptr || estimator == nullptr || error == nullptr) {
    return missing("rebounce_engine_estimate_error");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const Engine& frame = engine->engine;
    const ErrorEstimate found = estimator->estimator.estimate_error(
        frame.initial_exitance(), frame.indirect_irradiance(), frame.scheduler());
    *error = found.error;
    if (bound != nullptr) *bound = found.bound;
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c
