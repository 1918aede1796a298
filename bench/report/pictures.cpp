#include "bench/report/pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/default_view.h"
#include "runtime/demo/picture/key_light.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/frame/engine_parts.h"
#include "transfer/base/area_norm.h"

namespace rebounce::bench {
namespace {

constexpr int kSamplesPerAxis = 3;
constexpr const char* kGaussSeidel = "gauss-seidel";

Picture difference(const Picture& a, const Picture& b) {
  Picture result = b;
  for (std::size_t k = 0; k < result.pixel.size(); ++k) {
    for (int c = 0; c < kChannelCount; ++c) {
      result.pixel[k][c] = kDifferenceGain * std::abs(a.pixel[k][c] - b.pixel[k][c]);
    }
  }
  return result;
}

class Painter {
 public:
  Painter(const Contenders& contenders, const ReportSettings& settings,
          std::filesystem::path folder, std::string name)
      : data_(*contenders.data),
        engine_(contenders.data),
        renderer_(data_, *engine_.parts().tracer),
        folder_(std::move(folder)),
        name_(std::move(name)),
        lights_{make_key_light(data_, *engine_.parts().tracer)},
        emitted_(irradiance_from_emitters(data_)) {
    engine_.relight(lights_, {});
    picture_settings_.width = settings.picture_width;
    picture_settings_.height = settings.picture_height;
    picture_settings_.samples_per_axis = kSamplesPerAxis;
    picture_settings_.camera = default_camera(data_, *engine_.parts().tracer);
    truth_ = ReferenceSolver(data_.exchange, data_.patches)
                 .indirect_irradiance(engine_.initial_exitance());
    reference_ = draw(truth_);
    picture_settings_.exposure = reference_.exposure;
  }

  std::span<const Float3> initial_exitance() const { return engine_.initial_exitance(); }

  std::string save_reference() const { return save(reference_, "reference"); }

  /// H of a method, as a picture and its difference.
  void save_method(std::span<const Float3> indirect, const std::string& tag,
                   DrawnMethod& method) const {
    const Picture picture = draw(indirect);
    method.error = error(indirect);
    method.picture = save(picture, tag);
    method.difference = save(difference(picture, reference_), tag + "-difference");
  }

  /// Of H [n] in lx.
  double error(std::span<const Float3> indirect) const {
    return relative_difference(indirect, truth_, data_.patches.area);
  }

 private:
  Picture draw(std::span<const Float3> indirect) const {
    PictureLight light;
    light.lights = lights_;
    light.indirect_irradiance = indirect;
    light.emitted_irradiance = emitted_;
    return renderer_.render(light, picture_settings_);
  }

  std::string save(const Picture& picture, const std::string& tag) const {
    std::string file = name_ + "-" + tag + ".png";
    write_png(folder_ / file, tone_map(picture));
    return file;
  }

  const TransferData& data_;
  Engine engine_;
  PictureRenderer renderer_;
  std::filesystem::path folder_;
  std::string name_;
  std::vector<Light> lights_;
  std::vector<Float3> emitted_, truth_;
  PictureSettings picture_settings_;
  Picture reference_;
};

/// What Gauss-Seidel makes of the time that the inverse takes, on the compressed form of F on which
/// it gets nearest.
struct BestSweeps {
  DrawnMethod method;
  std::vector<Float3> indirect_irradiance;
};

BestSweeps find_best_sweeps(const Contenders& contenders,
                            const std::vector<Contestant>& contestants,
                            const std::vector<RunTime>& times, double time,
                            const Painter& painter) {
  BestSweeps best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < contestants.size(); ++k) {
    const Contestant& contestant = contestants[k];
    if (contestant.name.find(kGaussSeidel) == std::string::npos) continue;
    if (contestant.form == kExactRows || contestant.form == kExactHalf) continue;  // too slow
    const int sweeps = std::max(1, times[k].sweeps_within(time));
    const auto method = contestant.make(contenders);
    method->run(painter.initial_exitance(), sweeps);
    auto gathered = gather(*contenders.form(contestant.form), method->radiosity());
    if (painter.error(gathered) >= least) continue;
    least = painter.error(gathered);
    best = {{.name = contestant.name + ", " + contestant.form, .sweeps = sweeps},
            std::move(gathered)};
  }
  return best;
}

}  // namespace

Pictures draw_pictures(const Contenders& contenders, const std::vector<Contestant>& contestants,
                       const std::vector<RunTime>& times, const ReportSettings& settings,
                       const std::filesystem::path& folder, const std::string& name,
                       const ReportProgress& progress) {
  if (!progress("pictures", 0)) throw Cancelled();
  const Painter painter(contenders, settings, folder, name);
  Pictures pictures;
  pictures.reference = painter.save_reference();

  const auto inverse =
      std::ranges::find(contestants, hierarchical_name(kDefaultTolerance), &Contestant::transfer);
  pictures.time = times[inverse - contestants.begin()].start;
  const std::vector<Float3> indirect =
      product(*contenders.transfer(inverse->transfer), painter.initial_exitance());
  DrawnMethod by_inverse{.name = inverse->name + ", " + inverse->transfer};
  painter.save_method(indirect, "inverse", by_inverse);
  pictures.methods.push_back(by_inverse);

  if (!progress("pictures", 0.5)) throw Cancelled();
  BestSweeps best = find_best_sweeps(contenders, contestants, times, pictures.time, painter);
  painter.save_method(best.indirect_irradiance, kGaussSeidel, best.method);
  pictures.methods.push_back(best.method);
  return pictures;
}

}  // namespace rebounce::bench
