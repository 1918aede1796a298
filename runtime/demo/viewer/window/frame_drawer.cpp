#include "runtime/demo/viewer/window/frame_drawer.h"

#include <algorithm>
#include <chrono>

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

bool has_same_place(const ViewerSphere& a, const ViewerSphere& b) {
  return a.position == b.position && a.radius == b.radius;
}

}  // namespace

FrameDrawer::FrameDrawer(const std::shared_ptr<const TransferData>& data, const ViewerSetup& setup)
    : lit_(data, setup.reference, setup.make_probes), gpu_(*data), renderer_(gpu_, data->mesh) {}

void FrameDrawer::draw(ViewerState& state, int width, int height, GLuint framebuffer) {
  const std::vector<Light> lights = state.lights_now();
  lit_.relight(lights, state.sky, state.methods, state.is_split, times_);
  if (state.wants_exposure) {
    state.exposure = lit_.find_exposure(lights, state.sky, state.camera.camera(), state.show);
    state.wants_exposure = false;
  }
  if (state.show == Show::kError) compare(state);
  const std::vector<Light> lamps = without_profiles(lights);
  times_.upload = microseconds_of([&] {
    upload(state);
    std::vector<ViewerSphere> spheres = state.spheres_now();
    renderer_.set_bodies(make_spheres(spheres, state),
                         std::ranges::equal(spheres, spheres_, has_same_place), lamps);
    spheres_ = std::move(spheres);
  });
  times_.shadows = microseconds_of([&] { renderer_.update_shadows(lamps); });
  FrameSettings frame{.width = width,
                      .height = height,
                      .camera = state.camera.camera(),
                      .show = state.show,
                      .exposure = state.exposure,
                      .lights = lamps,
                      .sky = state.sky};
  if (state.is_split) frame.split = state.split;
  times_.draw = microseconds_of([&] { renderer_.draw(frame, framebuffer); });
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
  gpu_.upload_first_flight(lit_.first_flight_at_vertices(state.sky));
  gpu_.upload_bounced(Side::kFirst, lit_.bounced_at_vertices(Side::kFirst));
  if (state.is_split) gpu_.upload_bounced(Side::kSecond, lit_.bounced_at_vertices(Side::kSecond));
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
