#include "runtime/demo/picture/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "rebounce/error.h"
#include "runtime/demo/image/color_map.h"
#include "runtime/demo/image/exposure.h"
#include "runtime/demo/image/pixel_hash.h"
#include "runtime/demo/image/srgb.h"
#include "runtime/demo/image/tone_curve.h"
#include "runtime/demo/shading/direct_light.h"
#include "runtime/demo/shading/display_surface.h"
#include "runtime/demo/shading/emitters.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr int kTile = 16;  // pixels a side
constexpr int kLargestSide = 32768;
constexpr int kMaxSamplesPerAxis = 64;
constexpr int kMaxEmitterSamples = 65536;
constexpr int kMaxLayers = 16;    // layers that a camera ray sees through; the next one is opaque
const glm::vec3 kNothing(0.02F);  // background of patches and errors

void check_setting(int value, int most, const char* name) {
  if (value >= 1 && value <= most) return;
  throw Error("picture: " + std::string(name) + " is " + std::to_string(value) +
              "; it must be from 1 to " + std::to_string(most));
}

void check(const PictureSettings& settings) {
  check_setting(settings.width, kLargestSide, "width");
  check_setting(settings.height, kLargestSide, "height");
  check_setting(settings.samples_per_axis, kMaxSamplesPerAxis, "samples_per_axis");
  check_setting(settings.emitter_samples, kMaxEmitterSamples, "emitter_samples");
  const float fov = settings.camera.vertical_fov;
  if (!(fov > 0 && fov < std::numbers::pi_v<float>)) {
    throw Error("picture: the camera's vertical field of view is " + std::to_string(fov) +
                " radians; it must be between 0 and pi");
  }
}

// The camera rays of a tile, by pixel, then by sample.
struct CameraRays {
  std::vector<Ray> rays;
  std::vector<std::uint32_t> pixel;
  std::vector<std::uint32_t> index;
  std::vector<float> weight;  // of the pixel's colour
};

class View {
 public:
  explicit View(const PictureSettings& settings)
      : settings_(settings),
        pixel_width_(2 * std::tan(0.5F * settings.camera.vertical_fov) /
                     static_cast<float>(settings.height)) {}

  // The distance in metres between neighbouring samples at ray parameter t.
  float footprint(float t) const {
    return pixel_width_ * t / static_cast<float>(settings_.samples_per_axis);
  }

  CameraRays rays_of_tile(int left, int top) const {
    CameraRays tile;
    for (int y = top; y < std::min(top + kTile, settings_.height); ++y) {
      for (int x = left; x < std::min(left + kTile, settings_.width); ++x) {
        add_pixel(x, y, tile);
      }
    }
    return tile;
  }

 private:
  void add_pixel(int x, int y, CameraRays& tile) const {
    const auto pixel = static_cast<std::uint32_t>(y * settings_.width + x);
    const int n = settings_.samples_per_axis;
    for (int k = 0; k < n * n; ++k) {
      const auto index = static_cast<std::uint32_t>(k);
      const std::uint32_t seed = hash(pixel) ^ index;
      const int column = k % n, row = k / n;
      const float inside_x = (static_cast<float>(column) + hash_to_unit(seed, 3)) / n;
      const float inside_y = (static_cast<float>(row) + hash_to_unit(seed, 4)) / n;
      tile.rays.push_back(
          ray_through(static_cast<float>(x) + inside_x, static_cast<float>(y) + inside_y));
      tile.weight.push_back(1.0F / static_cast<float>(n * n));
      tile.pixel.push_back(pixel);
      tile.index.push_back(index);
    }
  }

  Ray ray_through(float x, float y) const {
    const Camera& camera = settings_.camera;
    const float right = (x - 0.5F * static_cast<float>(settings_.width)) * pixel_width_;
    const float up = (0.5F * static_cast<float>(settings_.height) - y) * pixel_width_;
    return {.origin = camera.position,
            .t_near = 0,
            .direction = to_float3(right * to_glm(camera.right) + up * to_glm(camera.up) -
                                   to_glm(camera.backward)),
            .t_far = std::numeric_limits<float>::infinity()};
  }

  const PictureSettings& settings_;
  float pixel_width_;  // at unit distance along the axis
};

// Returns the part of each ray that stops at its hit, and leaves the rest in the ray.
std::vector<CameraSample> seen_surface(CameraRays& tile, std::span<const Hit> hits, bool last_layer,
                                       const DisplaySurface& surface, const View& view) {
  std::vector<CameraSample> samples;
  samples.reserve(hits.size());
  CameraRays onward;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (hits[k].triangle == kNone) continue;
    const float opacity = last_layer ? 1 : surface.opacity(hits[k]);
    CameraSample sample{.pixel = tile.pixel[k], .index = tile.index[k]};
    sample.weight = opacity * tile.weight[k];
    sample.point = surface.point_at(hits[k]);
    const glm::vec3 direction = glm::normalize(to_glm(tile.rays[k].direction));
    // A slanted surface stretches the footprint in one direction; its mean width is used.
    const float cosine = std::abs(glm::dot(direction, sample.point.geometric_normal));
    sample.footprint = view.footprint(hits[k].t) / std::sqrt(std::max(cosine, 0.01F));
    samples.push_back(sample);
    if (opacity == 1) continue;
    onward.rays.push_back(tile.rays[k]);
    onward.rays.back().t_near = beyond(hits[k]);
    onward.pixel.push_back(tile.pixel[k]);
    onward.index.push_back(tile.index[k]);
    onward.weight.push_back((1 - opacity) * tile.weight[k]);
  }
  tile = std::move(onward);
  return samples;
}

// Draws into pixels. A picture has one painter; all threads use it, on different pixels.
class Painter {
 public:
  virtual ~Painter() = default;

  // Adds to `pixel` what a camera ray of `weight` sees where there is no surface.
  virtual void paint_background(std::uint32_t index, float weight, const glm::vec3& direction,
                                std::span<glm::vec3> pixel) = 0;

  // Adds the colours of `samples` to their pixels, times their weights.
  virtual void paint(std::span<CameraSample> samples, std::span<glm::vec3> pixel) = 0;
};

// Emitters, separate from lit surface: their mean where they cover a pixel.
struct ShiningLayer {
  std::vector<glm::vec3> luminance;  // cd/m² x coverage
  std::vector<float> coverage;       // [0, 1]

  explicit ShiningLayer(std::size_t pixel_count)
      : luminance(pixel_count, glm::vec3(0)), coverage(pixel_count, 0.0F) {}

  void add(std::uint32_t pixel, const glm::vec3& value, float weight) {
    luminance[pixel] += weight * value;
    coverage[pixel] += weight;
  }

  // A lamp may be a thousand times brighter than the screen's white. A pixel that it covers by a
  // sixteenth would be white too, and its edge jagged. So its colour is dimmed to `brightest`, with
  // the same hue, before it is blended.
  glm::vec3 dimmed(std::size_t pixel, float brightest) const {
    return rebounce::dimmed(luminance[pixel], brightest * coverage[pixel]);
  }
};

class LightPainter final : public Painter {
 public:
  LightPainter(const TransferData& data, const RayTracer& tracer, const DisplaySurface& surface,
               const PictureLight& light, const PictureSettings& settings)
      : tracer_(tracer),
        surface_(surface),
        emitters_(data, surface, settings.emitter_samples),
        light_(light),
        settings_(settings),
        vertex_light_(light_at_vertices(data, light)),
        reflected_(static_cast<std::size_t>(settings.width) * settings.height, 0.0F),
        coverage_(reflected_.size(), 0.0F),
        shining_(reflected_.size()) {}

  void paint_background(std::uint32_t index, float weight, const glm::vec3& direction,
                        std::span<glm::vec3>) override {
    if (settings_.show == Show::kIndirect) return;
    shining_.add(index, to_glm(sky_luminance(light_.sky, to_float3(direction))), weight);
  }

  void paint(std::span<CameraSample> samples, std::span<glm::vec3> pixel) override {
    if (settings_.show != Show::kIndirect) add_direct_light(samples);
    if (settings_.show != Show::kDirect) add_bounced_light(samples);
    for (const CameraSample& sample : samples) {
      const glm::vec3 emitted = surface_.emitted_luminance(sample.point, sample.footprint);
      const glm::vec3 reflected = surface_.albedo(sample.point, sample.footprint) *
                                  sample.irradiance * std::numbers::inv_pi_v<float>;
      pixel[sample.pixel] += sample.weight * reflected;
      if (emitted == glm::vec3(0)) {
        reflected_[sample.pixel] += sample.weight * luminance(reflected);
        coverage_[sample.pixel] += sample.weight;
      } else if (settings_.show != Show::kIndirect) {
        shining_.add(sample.pixel, emitted, sample.weight);
      }
    }
  }

  // The exposure for everything but emitters, in stops.
  float exposure() const {
    std::vector<float> mean;
    for (std::size_t k = 0; k < reflected_.size(); ++k) {
      if (coverage_[k] > 0) mean.push_back(reflected_[k] / coverage_[k]);
    }
    return automatic_exposure(std::move(mean));
  }

  // Adds emitters and sky; they need the exposure.
  void add_shining(float exposure, std::span<glm::vec3> pixel) const {
    const float brightest = kBrightestEmitter * std::exp2(-exposure);
    for (std::size_t k = 0; k < pixel.size(); ++k) pixel[k] += shining_.dimmed(k, brightest);
  }

 private:
  void add_direct_light(std::span<CameraSample> samples) const {
    add_punctual_light(samples, light_.lights, tracer_);
    add_emitter_light(samples, emitters_, tracer_,
                      settings_.samples_per_axis * settings_.samples_per_axis);
    add_from_vertices(vertex_light_.sky, samples);
  }

  void add_bounced_light(std::span<CameraSample> samples) const {
    add_from_vertices(vertex_light_.bounced, samples);
  }

  void add_from_vertices(std::span<const glm::vec3> value, std::span<CameraSample> samples) const {
    for (CameraSample& sample : samples) {
      sample.irradiance += interpolate(surface_.mesh(), value, sample.point);
    }
  }

  const RayTracer& tracer_;
  const DisplaySurface& surface_;
  Emitters emitters_;
  const PictureLight& light_;
  const PictureSettings& settings_;
  VertexLight vertex_light_;
  std::vector<float> reflected_, coverage_;  // by pixel, without emitters
  ShiningLayer shining_;
};

class PatchPainter final : public Painter {
 public:
  PatchPainter(const DisplaySurface& surface, const PictureLight& light,
               const PictureSettings& settings, std::size_t patch_count)
      : surface_(surface), error_(light.error), settings_(settings) {
    check_length(error_.size(), patch_count, "error");
    if (settings.show == Show::kError && error_.size() != patch_count) {
      throw Error("picture: no errors were given to show; give one number for each patch");
    }
    top_ = settings.error_top;
    if (!(top_ > 0) && !error_.empty()) top_ = *std::max_element(error_.begin(), error_.end());
  }

  void paint_background(std::uint32_t index, float weight, const glm::vec3& /*direction*/,
                        std::span<glm::vec3> pixel) override {
    pixel[index] += weight * kNothing;
  }

  void paint(std::span<CameraSample> samples, std::span<glm::vec3> pixel) override {
    for (const CameraSample& sample : samples) {
      pixel[sample.pixel] += sample.weight * color_of(sample.point);
    }
  }

 private:
  glm::vec3 color_of(const SurfacePoint& point) const {
    const std::uint32_t patch = surface_.mesh().triangle_patch[point.triangle];
    if (patch == kNone) return kNothing;
    if (settings_.show == Show::kError) return viridis(top_ > 0 ? error_[patch] / top_ : 0);
    const float facing = glm::dot(point.geometric_normal, to_glm(settings_.camera.backward) * 0.6F +
                                                              to_glm(settings_.camera.up) * 0.8F);
    return distinct_color(patch) * (0.75F + 0.25F * facing);
  }

  const DisplaySurface& surface_;
  std::span<const float> error_;
  const PictureSettings& settings_;
  float top_ = 0;
};

// Each pixel belongs to one tile and each tile to one thread, so the order of every sum is fixed.
std::vector<glm::vec3> paint_tiles(const RayTracer& tracer, const DisplaySurface& surface,
                                   const PictureSettings& settings, Painter& painter) {
  const View view(settings);
  const int columns = (settings.width + kTile - 1) / kTile;
  const int rows = (settings.height + kTile - 1) / kTile;
  std::vector<glm::vec3> pixel(static_cast<std::size_t>(settings.width) * settings.height,
                               glm::vec3(0));
#pragma omp parallel for schedule(dynamic)
  for (int tile = 0; tile < columns * rows; ++tile) {
    CameraRays camera = view.rays_of_tile(tile % columns * kTile, tile / columns * kTile);
    for (int layer = 0; layer <= kMaxLayers && !camera.rays.empty(); ++layer) {
      std::vector<Hit> hits(camera.rays.size());
      intersect_visible(tracer, surface, camera.rays, hits);
      for (std::size_t k = 0; k < hits.size(); ++k) {
        if (hits[k].triangle != kNone) continue;
        painter.paint_background(camera.pixel[k], camera.weight[k],
                                 glm::normalize(to_glm(camera.rays[k].direction)), pixel);
      }
      std::vector<CameraSample> samples =
          seen_surface(camera, hits, layer == kMaxLayers, surface, view);
      painter.paint(samples, pixel);
    }
  }
  return pixel;
}

std::vector<Float3> to_float3s(std::span<const glm::vec3> values) {
  std::vector<Float3> out(values.size());
  std::transform(values.begin(), values.end(), out.begin(),
                 [](const glm::vec3& v) { return to_float3(v); });
  return out;
}

}  // namespace

struct PictureRenderer::Impl {
  const TransferData& data;
  const RayTracer& tracer;
  DisplaySurface surface;

  Impl(const TransferData& scene, const RayTracer& rays)
      : data(scene), tracer(rays), surface(scene) {}
};

PictureRenderer::PictureRenderer(const TransferData& data, const RayTracer& tracer)
    : impl_(std::make_unique<Impl>(data, tracer)) {}
PictureRenderer::~PictureRenderer() = default;
PictureRenderer::PictureRenderer(PictureRenderer&&) noexcept = default;
PictureRenderer& PictureRenderer::operator=(PictureRenderer&&) noexcept = default;

Picture PictureRenderer::render(const PictureLight& light, const PictureSettings& settings) const {
  check(settings);
  if (settings.exposure) check_exposure(*settings.exposure);
  const auto& [data, tracer, surface] = *impl_;
  Picture picture{.width = settings.width, .height = settings.height};
  if (!shows_light(settings.show)) {
    PatchPainter painter(surface, light, settings, data.patches.size());
    picture.pixel = to_float3s(paint_tiles(tracer, surface, settings, painter));
    picture.display_referred = true;
    return picture;
  }
  LightPainter painter(data, tracer, surface, light, settings);
  std::vector<glm::vec3> pixel = paint_tiles(tracer, surface, settings, painter);
  picture.exposure = settings.exposure ? *settings.exposure : painter.exposure();
  painter.add_shining(picture.exposure, pixel);
  picture.pixel = to_float3s(pixel);
  return picture;
}

Picture render_picture(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                       const PictureSettings& settings) {
  return PictureRenderer(data, tracer).render(light, settings);
}

float exposure_for(const PictureRenderer& renderer, const PictureLight& light, const Camera& camera,
                   Show show) {
  PictureSettings small;
  small.width = 160;
  small.height = 90;
  small.camera = camera;
  small.show = show;
  small.samples_per_axis = 2;
  return renderer.render(light, small).exposure;
}

}  // namespace rebounce
