// Gauss-Seidel in the same frame, for comparison: form factors of a second file, a solver that goes
// on from its last solution, and the converged solution that both are judged by.

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "rebounce.h"
#include "runtime/frame/c_handles.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/solvers/conjugate_gradient_solver.h"
#include "runtime/solvers/gauss_seidel_solver.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/file/transfer_file_io.h"

namespace {

// The converged solution follows the light from frame to frame.
constexpr rebounce::SolveSettings kConverged{.max_sweeps = 60, .residual = 1e-5};

}  // namespace

struct rebounce_web_solver {
  rebounce_web_solver(std::shared_ptr<const rebounce::TransferData> of,
                      const rebounce::SafetensorsFile& file)
      : data(std::move(of)),
        form_factors(rebounce::read_form_factor_file(file, *data)),
        swept(form_factors, problem(), rebounce::SweepOrder::kSymmetric),
        converged(form_factors, problem()),
        swept_irradiance(data->patches.size()),
        converged_irradiance(data->patches.size()),
        workspace(form_factors.workspace_size()) {}

  rebounce::RadiosityProblem problem() const {
    return {data->patches.area, data->patches.reflectance};
  }
  double error(std::span<const rebounce::Float3> irradiance) const {
    return rebounce::relative_difference(irradiance, converged_irradiance, data->patches.area);
  }
  void gather(const rebounce::RadiositySolver& from, std::span<rebounce::Float3> irradiance) {
    form_factors.gather(from.radiosity(), irradiance, workspace);
  }

  std::shared_ptr<const rebounce::TransferData> data;
  rebounce::CompressedFormFactors form_factors;
  rebounce::GaussSeidelSolver swept;
  rebounce::ConjugateGradientSolver converged;
  std::vector<rebounce::Float3> swept_irradiance, converged_irradiance;
  std::vector<float> workspace;
};

namespace rebounce::c {

extern "C" {

/// Reads the file of form factors that was written with `transfer`.
[[clang::export_name("rebounce_web_solver_create")]] rebounce_status rebounce_web_solver_create(
    const rebounce_transfer* transfer, const void* bytes, std::size_t size, const char* name,
    rebounce_web_solver** solver) {
  return guarded(REBOUNCE_BAD_INPUT, [&] {
    const auto* const first = static_cast<const std::byte*>(bytes);
    const SafetensorsFile file(SharedArray(std::vector<std::byte>(first, first + size)), name);
    *solver = std::make_unique<rebounce_web_solver>(transfer->data, file).release();
    return REBOUNCE_OK;
  });
}

[[clang::export_name("rebounce_web_solver_destroy")]] void rebounce_web_solver_destroy(
    rebounce_web_solver* solver) {
  delete solver;
}

/// Finds the converged solution for the light of the engine's last frame. Writes the relative error
/// of the engine's indirect irradiance against it.
[[clang::export_name("rebounce_web_solver_converge")]] rebounce_status rebounce_web_solver_converge(
    rebounce_web_solver* solver, const rebounce_engine* engine, double* engine_error) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    solver->converged.solve(engine->engine.initial_exitance(), kConverged);
    solver->gather(solver->converged, solver->converged_irradiance);
    *engine_error = solver->error(engine->engine.indirect_irradiance());
    return REBOUNCE_OK;
  });
}

/// Sweeps for the light of the engine's last frame, from the solution before. Writes the
/// milliseconds of the sweeps, then the relative error of their indirect irradiance.
[[clang::export_name("rebounce_web_solver_sweep")]] rebounce_status rebounce_web_solver_sweep(
    rebounce_web_solver* solver, const rebounce_engine* engine, int sweeps, double* result) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const SolveResult swept =
        solver->swept.solve(engine->engine.initial_exitance(),
                            {.max_sweeps = sweeps, .residual = 0, .measure_residual = false});
    solver->gather(solver->swept, solver->swept_irradiance);
    result[0] = swept.microseconds / 1000;
    result[1] = solver->error(solver->swept_irradiance);
    return REBOUNCE_OK;
  });
}

/// Writes the relative error of any indirect irradiance of the patches, [n].
[[clang::export_name("rebounce_web_solver_error")]] rebounce_status rebounce_web_solver_error(
    const rebounce_web_solver* solver, const Float3* irradiance, double* error) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    *error = solver->error({irradiance, solver->data->patches.size()});
    return REBOUNCE_OK;
  });
}

/// Writes the swept irradiance at the vertices of the display mesh.
[[clang::export_name("rebounce_web_solver_vertex_irradiance")]] rebounce_status
rebounce_web_solver_vertex_irradiance(const rebounce_web_solver* solver, Float3* irradiance,
                                      std::size_t vertex_count) {
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    light_at_vertices(solver->data->mesh, solver->swept_irradiance, {irradiance, vertex_count});
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c
