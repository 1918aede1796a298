#include "runtime/demo/viewer/window/frame_drawer.h"

#include <algorithm>
#include <chrono>

#include "rebounce/error.h"
#include "runtime/demo/bake/punctual_light.h"
#include "runtime/demo/image/color_map.h"

namespace rebounce {
namespace {

// The microseconds of `work`, until the graphics card has finished it.
template <typename Work>
double microseconds_of(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  glFinish();
  const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
  return time.count();
}

// The lamps as the picture draws them: without profiles.
std::vector<Light> without_profiles(std::vector<Light> lights) {
  for (Light& light : lights) {
    if (light.profile) light = punctual_equivalent(light);
  }
  return lights;
}

// Adds times of the same stages to `sums`, which begins empty.
void add_by_stage(const std::vector<GpuStageTime>& times, std::vector<GpuStageTime>& sums) {
  if (sums.empty()) {
    sums = times;
    return;
  }
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k].microseconds += times[k].microseconds;
}

// Those that the card does not light; the others are dark.
std::vector<Light> dark_where_on_card(std::vector<Light> lights) {
  for (Light& light : lights) {
    if (CardLight::can_light(light)) light.intensity = 0;
  }
  return lights;
}

bool has_same_place(const ViewerSphere& a, const ViewerSphere& b) {
  return a.position == b.position && a.radius == b.radius;
}

}  // namespace

FrameDrawer::FrameDrawer(const std::shared_ptr<const TransferData>& data, const ViewerSetup& setup)
    : data_(data),
      lit_(data, setup.reference, setup.make_probes),
      gpu_(*data),
      renderer_(gpu_, data->mesh, lit_.emitter_lamps()),
      has_card_(CardLight::is_possible(*data)) {}

void FrameDrawer::draw(ViewerState& state, int width, int height, GLuint framebuffer) {
  const std::vector<Light> lights = state.lights_now();
  times_.direct = 0;
  make_card(state);
  const std::span<const IndirectMethod> methods = state.shown_methods();
  const bool any_on_card = std::ranges::any_of(methods, &IndirectMethod::on_card);
  if (any_on_card) {
    const auto direct = lit_.direct_light(dark_where_on_card(lights), state.sky, times_);
    others_.assign(direct.begin(), direct.end());
    // H - F M_e = Y rho (E + F M_e): the light of emitters is direct light of what they bounce.
    for (std::size_t i = 0; i < lit_.emitted_irradiance().size(); ++i) {
      for (std::size_t c = 0; c < kChannelCount; ++c)
        others_[i][c] += lit_.emitted_irradiance()[i][c];
    }
  }
  // What is not the light at vertices needs that of patches on the processor.
  const bool patches_of_card =
      state.wants_exposure || state.show == Show::kError || !state.spheres_now().empty();
  times_.solve = {};
  if (patches_of_card || !std::ranges::all_of(methods, &IndirectMethod::on_card)) {
    lit_.relight(lights, state.sky, state.methods, state.is_split, patches_of_card, times_);
  }
  if (state.wants_exposure) {
    state.exposure = lit_.find_exposure(lights, state.sky, state.camera.camera(), state.show);
    state.wants_exposure = false;
  }
  if (state.show == Show::kError) compare(state);
  const std::vector<Light> lamps = without_profiles(lights);
  const bool shows_direct = state.show == Show::kRadiosity || state.show == Show::kDirect;
  const bool draws_emitter_lamps = state.draws_emitter_lamps && shows_direct;
  times_.upload = microseconds_of([&] {
    upload(state);
    std::vector<ViewerSphere> spheres = state.spheres_now();
    renderer_.set_bodies(make_spheres(spheres, state),
                         std::ranges::equal(spheres, spheres_, has_same_place), lamps);
    spheres_ = std::move(spheres);
  });
  times_.shadows = microseconds_of([&] { renderer_.update_shadows(lamps, draws_emitter_lamps); });
  times_.card.clear();
  if (any_on_card) relight_on_card(state, lights);
  FrameSettings frame{.width = width,
                      .height = height,
                      .camera = state.camera.camera(),
                      .show = state.show,
                      .exposure = state.exposure,
                      .lights = lamps,
                      .draws_emitter_lamps = draws_emitter_lamps,
                      .sky = state.sky};
  if (state.is_split) frame.split = state.split;
  times_.draw = microseconds_of([&] { renderer_.draw(frame, framebuffer); });
}

void FrameDrawer::make_card(ViewerState& state) {
  if (card_ || std::ranges::none_of(state.shown_methods(), &IndirectMethod::on_card)) return;
  try {
    card_ = std::make_unique<CardLight>(data_);
  } catch (const Error& error) {
    card_refusal_ = error.what();
    has_card_ = false;
    for (IndirectMethod& method : state.methods) method.on_card = false;
  }
}

void FrameDrawer::upload(const ViewerState& state) {
  if (state.show == Show::kError) {
    upload_errors();
    return;
  }
  if (state.show == Show::kPatches) {
    std::vector<glm::vec3> color(lit_.data().patches.size());
    for (std::uint32_t i = 0; i < color.size(); ++i) color[i] = distinct_color(i);
    gpu_.upload_patch_colors(Side::kFirst, color);
    gpu_.upload_patch_colors(Side::kSecond, color);
    return;
  }
  gpu_.upload_first_flight(lit_.first_flight_at_vertices(state.sky, state.draws_emitter_lamps));
  for (std::size_t k = 0; k < state.shown_methods().size(); ++k) {
    const auto side = static_cast<Side>(k);
    if (!state.methods[k].on_card) gpu_.upload_bounced(side, lit_.bounced_at_vertices(side));
  }
}

void FrameDrawer::relight_on_card(const ViewerState& state, std::span<const Light> lights) {
  std::vector<GpuLamp> lamps;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    if (CardLight::can_light(lights[k])) {
      lamps.push_back(renderer_.shadow_map(k).for_card(lights[k]));
    }
  }
  for (std::size_t k = 0; k < state.shown_methods().size(); ++k) {
    if (!state.methods[k].on_card) continue;
    card_->relight(lamps, others_, gpu_.bounced_buffer(static_cast<Side>(k)));
    add_by_stage(card_->stage_times(), times_.card);
  }
}

BodyMesh FrameDrawer::make_spheres(std::span<const ViewerSphere> spheres,
                                   const ViewerState& state) {
  BodyMesh mesh;
  for (const ViewerSphere& sphere : spheres) {
    const LightInAir light =
        lit_.light_in_air(sphere.position, sphere_normals(), state.sky, state.is_split);
    const auto shade = [&](std::size_t k) {
      return BodyVertex{.color = sphere.reflectance,
                        .first_flight = light.first_flight[k],
                        .bounced = {light.bounced[0][k], light.bounced[1][k]}};
    };
    add_sphere(sphere.position, sphere.radius, shade, mesh);
  }
  return mesh;
}

void FrameDrawer::compare(const ViewerState& state) {
  error_top_ = 0;
  for (const Side side : {Side::kFirst, Side::kSecond}) {
    auto& error = patch_error_[static_cast<std::size_t>(side)];
    error.clear();
    if (side == Side::kSecond && !state.is_split) break;
    error = lit_.patch_errors(side);
    if (!error.empty()) error_top_ = std::max(error_top_, *std::ranges::max_element(error));
  }
}

void FrameDrawer::upload_errors() {
  // Both sides use the same colours.
  for (const Side side : {Side::kFirst, Side::kSecond}) {
    std::vector<glm::vec3> color(lit_.data().patches.size(), glm::vec3(0.02F));
    const auto& error = patch_error_[static_cast<std::size_t>(side)];
    for (std::size_t i = 0; i < error.size(); ++i) {
      color[i] = viridis(error_top_ > 0 ? error[i] / error_top_ : 0);
    }
    gpu_.upload_patch_colors(side, color);
  }
}

}  // namespace rebounce
