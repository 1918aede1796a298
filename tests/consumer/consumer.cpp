// Relights a transfer file: by lights, by the direct irradiance that those gave, and by that on
// threads of its own; then solves it by iteration.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <vector>

#include "../support/thread_pool.h"
#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "rebounce/solvers.h"
#include "rebounce/transfer_file.h"
#include "rebounce/version.h"

namespace {

void require(bool condition, const char* what) {
  if (!condition) throw rebounce::Error(what);
}

/// The direct irradiance of a lamp.
std::vector<rebounce::Float3> direct_light(rebounce::Engine& engine) {
  rebounce::Light lamp;
  lamp.position = {0, 1, 0};
  engine.relight({&lamp, 1}, {});
  return {engine.direct_irradiance().begin(), engine.direct_irradiance().end()};
}

void check_refusals(rebounce::Engine& engine, std::vector<rebounce::Float3> direct) {
  const std::vector<rebounce::Float3> before(engine.radiosity().begin(), engine.radiosity().end());
  direct[1][2] = std::numeric_limits<float>::quiet_NaN();
  bool refused = false;
  try {
    engine.relight(direct);
  } catch (const rebounce::Error&) {
    refused = true;
  }
  require(refused, "light that is no number was taken");
  require(std::ranges::equal(before, engine.radiosity()), "a refused frame changed the last one");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const auto data = rebounce::load_transfer(argv[1]);
    const rebounce::SceneData& scene = rebounce::scene_data(*data);
    rebounce::Engine engine(data);
    const std::vector<rebounce::Float3> direct = direct_light(engine);
    engine.relight(direct);
    check_refusals(engine, direct);
    rebounce::test::ThreadPool pool(2);
    rebounce::Engine pooled(data, {.scheduler = pool.scheduler()});
    pooled.relight(direct);
    require(pool.loop_count() > 0 && std::ranges::equal(pooled.radiosity(), engine.radiosity()),
            "a frame on threads of the caller is another");
    std::vector<rebounce::Float3> vertices(scene.mesh.position.size());
    rebounce::vertex_irradiance(engine, vertices);
    std::vector<rebounce::ProbeLight> probes(scene.probes.size());
    rebounce::probe_light(engine, probes);

    rebounce::Solver solver(data, rebounce::SolveMethod::kConjugateGradient);
    require(solver.solve(engine.initial_exitance()).converged, "a solve does not converge");
    double sum = 0, difference = 0;
    for (std::size_t i = 0; i < scene.patches.size(); ++i) {
      sum += solver.radiosity()[i][0];
      difference += std::abs(solver.radiosity()[i][0] - engine.radiosity()[i][0]);
    }
    require(sum > 0 && difference < 0.05 * sum, "operator and form factors are of different light");
    std::printf("%s: %zu patches, %zu vertices, sum of radiosity %g\n", rebounce::version(),
                scene.patches.size(), vertices.size(), sum);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
