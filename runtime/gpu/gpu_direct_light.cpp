#include "runtime/gpu/gpu_direct_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/error.h"
#include "runtime/gpu/shader_sources.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/rays/float3_glm.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {
namespace {

using Words = std::array<std::uint32_t, 4>;
using Floats = std::array<float, 4>;

// A point is moved off its surface by this many texels of the shadow map: what a slanted texel and
// its neighbours reach.
constexpr float kTexelsOffSurface = 2;
constexpr std::uint32_t kPatchesPerGroup = 8;

struct ViewBlock {
  std::array<float, 16> texture_from_world;
  Floats layer;
};

constexpr std::size_t kLampsPerRun = GlTextureGuard::kSlots;

struct LampBlock {
  Words kind{};
  Floats position{}, direction{}, color{}, depth_range{};
  std::array<ViewBlock, GpuLamp::kMostViews> views{};
};
/// The uniform block of direct_light.glsl.
struct RunBlock {
  Words range{}, runs{};
  std::array<LampBlock, kLampsPerRun> lamps{};
};
// Between runs: a multiple of the most that a context may ask for.
constexpr std::size_t kRunStride = (sizeof(RunBlock) + 255) / 256 * 256;

// Runs that do not wait for each other; the last of them adds what the others have written.
constexpr std::size_t kRunsAtOnce = 4;

/// Runs for this many lamps. Without lamps, one writes what others give.
std::size_t runs_for(std::size_t lamp_count) {
  return std::max<std::size_t>((lamp_count + kLampsPerRun - 1) / kLampsPerRun, 1);
}

enum class Before : std::uint8_t { kThisBuffer, kNothing, kOthers };

struct TextureKind {
  GlFunctions::Enum target, binding;
};

TextureKind texture_kind(GpuShadowMap map) {
  switch (map) {
    case GpuShadowMap::kPlane:
      return {Gl::kTexture2D, Gl::kTexture2DBinding};
    case GpuShadowMap::kLayers:
      return {Gl::kTextureArray, Gl::kTextureArrayBinding};
    case GpuShadowMap::kNoShadow:
    case GpuShadowMap::kCube:
      break;
  }
  return {Gl::kTextureCube, Gl::kTextureCubeBinding};
}

/// The unit of the shadow map of a run's lamp `slot`.
unsigned unit_of(GpuShadowMap map, std::size_t slot) {
  return GlTextureGuard::unit(static_cast<unsigned>(map) - 1, static_cast<unsigned>(slot));
}

/// Whether depth falls with the distance from the lamp.
bool depth_falls(const GpuLamp& lamp) {
  if (lamp.shadow_map == GpuShadowMap::kCube) return lamp.depth_range[0] > lamp.depth_range[1];
  if (lamp.views.empty()) return false;
  const auto& m = lamp.views[0].texture_from_world;
  const auto row = [&](std::size_t k) { return glm::vec3(m[k], m[4 + k], m[8 + k]); };
  const glm::vec3 depth = row(2), along = row(3);
  const float squared = glm::dot(along, along);
  if (squared == 0) return glm::dot(depth, to_glm(lamp.light.direction)) < 0;
  // At places where the fourth coordinate is 1 and 2.
  const auto depth_at = [&](float w) {
    return (glm::dot(depth, along) * ((w - m[15]) / squared) + m[14]) / w;
  };
  return depth_at(2) < depth_at(1);
}

[[noreturn]] void refuse_lamp(std::size_t number, const std::string& why) {
  throw Error("lamp " + std::to_string(number) + ": " + why);
}

void check_views(std::size_t number, const GpuLamp& lamp) {
  if (lamp.views.empty() || lamp.views.size() > GpuLamp::kMostViews) {
    refuse_lamp(number, "its shadow map has " + std::to_string(lamp.views.size()) +
                            " views; give from 1 to " + std::to_string(GpuLamp::kMostViews));
  }
  for (const GpuShadowView& view : lamp.views) {
    if (!std::ranges::all_of(view.texture_from_world, [](float x) { return std::isfinite(x); })) {
      refuse_lamp(number, "a number of a matrix is not finite");
    }
  }
}

void check_lamp(std::size_t number, const GpuLamp& lamp) {
  const LampKind& kind = lamp_kind(lamp.light.type);
  try {
    check_light(lamp.light);
  } catch (const Error& error) {
    refuse_lamp(number, error.what());
  }
  if (kind.surface != nullptr || lamp.light.profile) {
    refuse_lamp(
        number,
        "the graphics card has points, spots and directional lights without profiles; add the "
        "light of others by a buffer");
  }
  if (lamp.shadow_map == GpuShadowMap::kNoShadow) return;
  if (lamp.shadow_map != GpuShadowMap::kCube) {
    check_views(number, lamp);
    return;
  }
  if (!kind.has_place()) refuse_lamp(number, "a cube around a directional light has no place");
  const auto [first, last] = lamp.depth_range;
  if (!(first > 0 && last > 0) || first == last) {
    refuse_lamp(number, "the depths of its cube need two distances above 0 that differ");
  }
}

/// A number of the base level of `image`: a face of the cube, or else what is bound to `target`.
int texture_number(const GlFunctions& gl, GlFunctions::Enum target, GlFunctions::Enum image,
                   GlFunctions::Enum name) {
  int base_level = 0, number = 0;
  gl.get_texture(target, Gl::kBaseLevel, &base_level);
  gl.get_texture_level(image, base_level, name, &number);
  return number;
}

/// Whether the texture that is bound to `target` has storage for depths, a cube at every face.
bool has_depths(const GlFunctions& gl, GlFunctions::Enum target) {
  const bool is_cube = target == Gl::kTextureCube;
  const GlFunctions::Enum first = is_cube ? Gl::kFirstCubeFace : target;
  const unsigned image_count = is_cube ? 6 : 1;
  for (unsigned k = 0; k < image_count; ++k) {
    if (texture_number(gl, target, first + k, Gl::kDepthBits) == 0) return false;
  }
  return true;
}

void check_layers(std::size_t number, const GpuLamp& lamp, int layer_count) {
  for (const GpuShadowView& view : lamp.views) {
    if (std::cmp_greater_equal(view.layer, layer_count)) {
      refuse_lamp(number, "a view is in layer " + std::to_string(view.layer) + ", and texture " +
                              std::to_string(lamp.texture) + " has " + std::to_string(layer_count) +
                              " layers; count them from 0, and draw one for each view");
    }
  }
}

/// The views that its shadow map has; others do not count, and are not looked at.
std::span<const GpuShadowView> views_of(const GpuLamp& lamp) {
  const bool has_views =
      lamp.shadow_map == GpuShadowMap::kPlane || lamp.shadow_map == GpuShadowMap::kLayers;
  return has_views ? lamp.views : std::span<const GpuShadowView>();
}

LampBlock block_of(const GpuLamp& lamp) {
  const PreparedLight light(lamp.light);
  const std::span<const GpuShadowView> views = views_of(lamp);
  const bool has_place = light.kind->has_place();
  LampBlock block;
  block.kind = {has_place ? 1U : 2U, static_cast<std::uint32_t>(lamp.shadow_map),
                static_cast<std::uint32_t>(views.size()), 0};
  block.position = {light.position.x, light.position.y, light.position.z,
                    has_place ? 1 / light.reach_squared : 0};
  const bool has_cone = light.kind->uses(kCone);
  block.direction = {light.direction.x, light.direction.y, light.direction.z,
                     has_cone ? light.cone_cosine : -2};
  const glm::vec3 color = to_glm(lamp.light.color) * lamp.light.intensity;
  block.color = {color.x, color.y, color.z, has_cone ? light.cone_scale : 1};
  block.depth_range = {1 / lamp.depth_range[0], 1 / lamp.depth_range[1], kTexelsOffSurface, 0};
  for (std::size_t k = 0; k < views.size(); ++k) {
    block.views[k] = {views[k].texture_from_world, {static_cast<float>(views[k].layer), 0, 0, 0}};
  }
  return block;
}

/// [patch][point]: position and normal, four floats each.
std::vector<Floats> point_table(const TransferData& data, const DirectLightingSettings& settings) {
  std::vector<Floats> table;
  for (const auto& [position, normal] : receiver_points(data, settings)) {
    table.push_back({position[0], position[1], position[2], 1});
    table.push_back({normal[0], normal[1], normal[2], 0});
  }
  return table;
}

StorageBuffer point_buffer(const std::shared_ptr<const GlFunctions>& gl, const TransferData& data,
                           const DirectLightingSettings& settings) {
  const std::vector<Floats> table = point_table(data, settings);
  return {gl, table.size() * sizeof(Floats), table.data()};
}

}  // namespace

GpuDirectLight::GpuDirectLight(const std::shared_ptr<const GlFunctions>& gl,
                               const TransferData& data, const DirectLightingSettings& settings)
    : gl_(gl),
      patch_count_(data.patches.size()),
      points_per_patch_(static_cast<std::size_t>(std::max(0, settings.points_per_patch))),
      program_(gl, "direct_light.glsl", ShaderSources::kDirectLight),
      points_(point_buffer(gl, data, settings)),
      runs_(gl,
            kRunStride * runs_for(static_cast<std::size_t>(std::max(1, settings.light_capacity))),
            nullptr),
      of_runs_(gl, kChannelCount * sizeof(float) * patch_count_ * (kRunsAtOnce - 1), nullptr) {
  gl_->gen_samplers(2, samplers_);
  for (int k = 0; k < 2; ++k) {
    const auto set = [&](GlFunctions::Enum parameter, GlFunctions::Enum value) {
      gl_->set_sampler(samplers_[k], parameter, static_cast<int>(value));
    };
    set(Gl::kMinFilter, Gl::kLinear);
    set(Gl::kMagFilter, Gl::kLinear);
    set(Gl::kWrapS, Gl::kClampToEdge);
    set(Gl::kWrapT, Gl::kClampToEdge);
    set(Gl::kCompareMode, Gl::kCompareToTexture);
    set(Gl::kCompareFunction, k == 0 ? Gl::kLessOrEqual : Gl::kGreaterOrEqual);
  }
}

GpuDirectLight::~GpuDirectLight() {
  gl_->delete_samplers(2, samplers_);
}

std::size_t GpuDirectLight::bytes() const {
  return points_.size() + runs_.size() + of_runs_.size();
}

/// Whether the texture of a lamp is of the kind of its shadow map; it is bound then, its unit
/// active.
bool GpuDirectLight::bind_to_look(const GpuLamp& lamp) const {
  if (gl_->is_texture(lamp.texture) == 0) return false;
  const TextureKind kind = texture_kind(lamp.shadow_map);
  int bound = 0;
  gl_->active_texture(Gl::kTexture0 + unit_of(lamp.shadow_map, 0));
  gl_->bind_texture(kind.target, 0);
  gl_->bind_texture(kind.target, lamp.texture);
  gl_->get_integer(kind.binding, &bound);
  if (bound == 0) gl_->get_error();  // that it has another kind
  return bound != 0;
}

void GpuDirectLight::check_texture(std::size_t number, const GpuLamp& lamp) const {
  if (lamp.shadow_map == GpuShadowMap::kNoShadow) return;
  if (!bind_to_look(lamp)) {
    refuse_lamp(number,
                std::to_string(lamp.texture) + " is no texture of the kind of its shadow map");
  }
  const GlFunctions::Enum target = texture_kind(lamp.shadow_map).target;
  if (!has_depths(*gl_, target)) {
    refuse_lamp(number, "texture " + std::to_string(lamp.texture) +
                            " has no storage for depths; give it some, of a depth format, and draw "
                            "the shadow map");
  }
  if (lamp.shadow_map == GpuShadowMap::kLayers)
    check_layers(number, lamp, texture_number(*gl_, target, target, Gl::kLayerCount));
}

void GpuDirectLight::bind_texture(const GpuLamp& lamp, std::size_t slot) const {
  if (lamp.shadow_map == GpuShadowMap::kNoShadow) return;
  const unsigned unit = unit_of(lamp.shadow_map, slot);
  gl_->active_texture(Gl::kTexture0 + unit);
  gl_->bind_texture(texture_kind(lamp.shadow_map).target, lamp.texture);
  gl_->bind_sampler(unit, samplers_[depth_falls(lamp) ? 1 : 0]);
}

void GpuDirectLight::check(std::span<const GpuLamp> lamps) const {
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    check_lamp(k, lamps[k]);
    check_texture(k, lamps[k]);
  }
}

void GpuDirectLight::run(std::span<const GpuLamp> lamps, unsigned others,
                         unsigned direct_irradiance) {
  const std::size_t run_count = runs_for(lamps.size());
  const auto lamps_of = [&](std::size_t k) {
    const std::span<const GpuLamp> left = lamps.subspan(k * kLampsPerRun);
    return left.first(std::min(left.size(), kLampsPerRun));
  };
  const auto is_last = [&](std::size_t k) {
    return (k + 1) % kRunsAtOnce == 0 || k + 1 == run_count;
  };
  const auto of_run = static_cast<std::uint32_t>(kChannelCount * patch_count_);
  blocks_.assign(run_count * kRunStride, 0);
  for (std::size_t k = 0; k < run_count; ++k) {
    RunBlock block;
    std::ranges::transform(lamps_of(k), block.lamps.begin(), block_of);
    const auto own_place = static_cast<std::uint32_t>(k % kRunsAtOnce);
    const Before first = others != 0 ? Before::kOthers : Before::kNothing;
    const Before before = k < kRunsAtOnce ? first : Before::kThisBuffer;
    block.range = {static_cast<std::uint32_t>(patch_count_),
                   static_cast<std::uint32_t>(points_per_patch_),
                   static_cast<std::uint32_t>(lamps_of(k).size()),
                   static_cast<std::uint32_t>(is_last(k) ? before : Before::kNothing)};
    block.runs = is_last(k) ? Words{0, own_place, of_run} : Words{own_place * of_run, 0, of_run};
    std::memcpy(blocks_.data() + k * kRunStride, &block, sizeof(block));
  }
  runs_.replace(blocks_.size(), blocks_.data());
  gl_->bind_buffer_base(Gl::kStorageBuffer, 0, points_.name());
  gl_->bind_buffer_base(Gl::kStorageBuffer, 2, others);
  gl_->bind_buffer_base(Gl::kStorageBuffer, 3, of_runs_.name());
  const auto groups =
      static_cast<std::uint32_t>((patch_count_ + kPatchesPerGroup - 1) / kPatchesPerGroup);
  for (std::size_t k = 0; k < run_count; ++k) {
    std::size_t slot = 0;
    for (const GpuLamp& lamp : lamps_of(k)) bind_texture(lamp, slot++);
    gl_->bind_buffer_base(Gl::kStorageBuffer, 1, is_last(k) ? direct_irradiance : of_runs_.name());
    gl_->bind_buffer_range(Gl::kUniformBuffer, GlStateGuard::kStageBinding, runs_.name(),
                           static_cast<std::ptrdiff_t>(k * kRunStride), sizeof(RunBlock));
    if (is_last(k)) gl_->memory_barrier(Gl::kStorageBarrier);
    program_.run(groups);
    if (is_last(k)) gl_->memory_barrier(Gl::kStorageBarrier);
  }
}

}  // namespace rebounce
