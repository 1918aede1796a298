// Relights a transfer file: by lights, if the library traces them, by the direct irradiance that
// those gave, and by that on threads of its own.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <vector>

#include "../support/thread_pool.h"
#include "runtime/frame/engine.h"
#include "runtime/outputs/vertex_light.h"
#include "transfer/file/transfer_file.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const auto data =
        std::make_shared<const rebounce::TransferData>(rebounce::load_transfer_file(argv[1]));
    rebounce::Engine engine(data);
    std::vector<rebounce::Float3> direct(data->patches.size(), {100, 90, 80});
#if REBOUNCE_WITH_EMBREE
    rebounce::Light lamp;
    lamp.position = {0, 1, 0};
    engine.relight({&lamp, 1}, {});
    direct.assign(engine.direct_irradiance().begin(), engine.direct_irradiance().end());
#endif
    engine.relight(direct);
    rebounce::test::ThreadPool pool(2);
    rebounce::Engine pooled(data, {.scheduler = pool.scheduler()});
    pooled.relight(direct);
    if (pool.loop_count() == 0 || !std::ranges::equal(pooled.radiosity(), engine.radiosity())) {
      std::fprintf(stderr, "a frame on threads of the caller is another\n");
      return 1;
    }
    std::vector<rebounce::Float3> vertices(data->mesh.position.size());
    rebounce::reconstruct_at_vertices(data->mesh, engine.indirect_irradiance(), vertices);
    double sum = 0;
    for (const rebounce::Float3& e : engine.indirect_irradiance()) sum += e[0];
    std::printf("%zu patches, %zu vertices, sum of indirect irradiance %g\n", data->patches.size(),
                vertices.size(), sum);
    return sum > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
