#include "bench/report/rest_of_frame.h"

#include <omp.h>

#include <algorithm>
#include <array>

#include "bench/support/light_changes.h"
#include "rebounce/error.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/box.h"

namespace rebounce::bench {
namespace {

constexpr std::size_t kLampCount = 4, kMovingCount = 2;
constexpr int kLeastRounds = 15;  // the work is short

MovingLamps place_lamps(const Contenders& contenders, std::uint64_t seed) {
  const TransferData& data = *contenders.data;
  const double diagonal = box_around(data.mesh.position).diagonal();
  const auto places = lamps_in_the_open(data, *contenders.tracer, 8 * kLampCount, seed);
  if (places.size() < 2 * kMovingCount) throw Error("the report finds no places for its lamps");
  MovingLamps result;
  for (std::size_t k = 0; k < kLampCount; ++k) {
    const auto lamp_at = [&](std::size_t place) {
      const Float3& target = data.patches.centroid[(k * data.patches.size()) / kLampCount];
      return lamp_of_type(kLampTypes[k], places[place % places.size()], target, diagonal);
    };
    result.lamps.push_back(lamp_at(2 * k));
    if (k < kMovingCount) result.elsewhere.push_back(lamp_at(2 * k + 1));
  }
  return result;
}

}  // namespace

RestOfFrame measure_rest_of_frame(const Contenders& contenders, const ReportSettings& settings,
                                  const ReportProgress& progress) {
  if (!progress("the rest of a frame", 0)) throw Cancelled();
  MovingLamps lamps = place_lamps(contenders, settings.seed);
  Engine engine(contenders.data);
  engine.relight(lamps.next(), {});
  std::vector<Float3> vertices(contenders.data->mesh.position.size());
  const std::array<TimedCase, 2> cases = {
      TimedCase{.work =
                    [&] {
                      engine.parts().compute_direct(lamps.next(), {});
                      engine.parts().compute_initial_exitance();
                    }},
      TimedCase{.work =
                    [&] {
                      reconstruct_at_vertices(contenders.data->mesh, engine.indirect_irradiance(),
                                              vertices);
                    }},
  };
  const int threads = omp_get_max_threads();
  omp_set_num_threads(settings.solve_threads);
  const auto times = time_interleaved(cases, {.rounds = std::max(kLeastRounds, settings.repeats)});
  omp_set_num_threads(threads);
  return {times[0], times[1]};
}

}  // namespace rebounce::bench
