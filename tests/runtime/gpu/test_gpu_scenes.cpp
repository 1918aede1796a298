#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rebounce/build_settings.h"
#include "runtime/outputs/texel_light.h"
#include "runtime/outputs/vertex_light.h"
#include "tests/gl/shadow_maps.h"
#include "tests/runtime/gpu/gpu_frame.h"
#include "tests/support/built_scene.h"
#include "transfer/base/area_norm.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/format/hierarchical_values.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_gpu_scenes {
namespace {

class GpuScenes : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Shipped, GpuScenes,
                         testing::Values("cornell_box", "furnished_room", "pavilion", "three_rooms",
                                         "two_rooms", "white_room"),
                         [](const auto& instance) { return std::string(instance.param); });

/// Y M0 by plain sums over the stored operator.
std::vector<Float3> exact_irradiance(const Engine& engine) {
  const std::size_t n = engine.radiosity().size();
  std::vector<Float3> irradiance(n);
  std::vector<float> transfer(n * n);
  for (int c = 0; c < kChannelCount; ++c) {
    engine.data().transfer->expand(c, transfer);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j)
        sum += double{transfer[i * n + j]} * engine.initial_exitance()[j][c];
      irradiance[i][c] = static_cast<float>(sum);
    }
  }
  return irradiance;
}

/// The memory of [p][9] as probes.
std::span<QuadraticProbeLight> as_probes(std::vector<Float3>& coefficients) {
  static_assert(sizeof(QuadraticProbeLight) == kHarmonicCount * sizeof(Float3));
  return {reinterpret_cast<QuadraticProbeLight*>(coefficients.data()),
          coefficients.size() / kHarmonicCount};
}

/// The shipped scenes are not unwrapped: texels all over the triangles, and some that show nothing.
void add_lightmap(TransferData& data) {
  constexpr std::uint32_t kSide = 64;
  data.lightmap.width = data.lightmap.height = kSide;
  for (std::uint32_t k = 0; k < kSide * kSide; ++k) {
    const float second = static_cast<float>(k % 7) / 7;
    data.lightmap.triangle.push_back(
        k % 5 == 0 ? kNone : static_cast<std::uint32_t>(k % data.mesh.triangle.size()));
    data.lightmap.weight.push_back({second, (1 - second) * static_cast<float>(k % 3) / 3});
  }
}

/// What a texture has that takes the light from its buffer on the card, as engines do.
std::vector<Float3> texture_from(const test::LightBuffer& light, const Lightmap& lightmap) {
  const auto width = static_cast<GLsizei>(lightmap.width),
             height = static_cast<GLsizei>(lightmap.height);
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGB32F, width, height);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, light.name());
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGB, GL_FLOAT, nullptr);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  std::vector<Float3> texels(lightmap.triangle.size());
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RGB, GL_FLOAT, texels.data());
  glDeleteTextures(1, &texture);
  return texels;
}

/// A scene of few patches with a lightmap and probes.
std::shared_ptr<const TransferData> scene(const std::string& name, bool rows_at_vertices = false) {
  BuildSettings settings = test::quick_settings(600);
  settings.receiver_rows.at_vertices = rows_at_vertices;
  settings.receiver_rows.least_error = 0;
  settings.probes.grid = {3, 2, 3};
  settings.probes.ray_count = 512;
  TransferData built = test::built_scene(name + ".gltf", settings);
  add_lightmap(built);
  return std::make_shared<const TransferData>(std::move(built));
}

/// The same with the values of the operator in floats, so that the processor rounds no light.
std::shared_ptr<const TransferData> in_floats(const TransferData& data) {
  auto floats = std::make_shared<TransferData>(data);
  const auto& stored = dynamic_cast<const HierarchicalOperator&>(*data.transfer);
  floats->transfer = std::make_shared<const HierarchicalOperator>(
      encode_values(decode(stored.storage()), Precision::kF32));
  return floats;
}

Light lamp_in_the_middle(const TransferData& data) {
  Light lamp;
  lamp.intensity = 100;
  for (const Float3& centroid : data.patches.centroid) {
    for (int c = 0; c < kChannelCount; ++c) {
      lamp.position[c] += centroid[c] / static_cast<float>(data.patches.size());
    }
  }
  return lamp;
}

/// What a frame of the processor or the card writes.
struct FrameLight {
  std::vector<Float3> indirect, radiosity, vertices, texels, probes;

  explicit FrameLight(Engine& engine)
      : indirect(engine.indirect_irradiance().begin(), engine.indirect_irradiance().end()),
        radiosity(engine.radiosity().begin(), engine.radiosity().end()),
        vertices(engine.data().mesh.position.size()),
        texels(engine.data().lightmap.triangle.size()),
        probes(kHarmonicCount * engine.data().probes.size()) {
    vertex_irradiance(engine, vertices);
    lightmap_irradiance(engine, texels);
    probe_light(engine, as_probes(probes));
  }
  FrameLight() = default;

  /// The largest difference of each.
  std::array<double, 5> differences(const FrameLight& other) const {
    return {test::largest_difference(indirect, other.indirect),
            test::largest_difference(radiosity, other.radiosity),
            test::largest_difference(vertices, other.vertices),
            test::largest_difference(texels, other.texels),
            test::largest_difference(probes, other.probes)};
  }
};

/// What the card writes of the direct light of a frame.
FrameLight light_of_the_card(const Engine& engine) {
  const std::shared_ptr<const TransferData>& data = engine.shared_data();
  GpuEngine gpu(data, eglGetProcAddress);
  gpu.set_sky(engine.sky());
  const test::FrameBuffers buffers(*data, engine.direct_irradiance());
  const test::LightBuffer lightmap(data->lightmap.triangle.size()),
      probes(kHarmonicCount * data->probes.size());
  GpuBuffers names = buffers.names();
  names.lightmap_irradiance = lightmap.name();
  names.probe_light = probes.name();
  gpu.relight(names);
  FrameLight found;
  found.indirect = buffers.indirect.read();
  found.radiosity = buffers.radiosity.read();
  found.vertices = buffers.vertices.read();
  found.texels = lightmap.read();
  found.probes = probes.read();
  EXPECT_EQ(found.texels, texture_from(lightmap, data->lightmap));
  return found;
}

/// How much larger than at patches rounding may be at each vertex: the sum of the magnitudes of its
/// weights, which have both signs.
std::vector<Float3> growth_at_vertices(const DisplayMesh& mesh) {
  std::vector<Float3> growth(mesh.position.size());
  for (std::size_t v = 0; v < growth.size(); ++v) {
    float sum = 0;
    for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
      sum += std::abs(mesh.weight[k]);
    }
    growth[v].fill(std::max(1.0F, sum));
  }
  return growth;
}

/// The largest difference, as a part of the mean of `wanted`, where each is divided by its growth.
double largest_difference_over(std::span<const Float3> growth, std::span<const Float3> wanted,
                               std::vector<Float3> found) {
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (int c = 0; c < kChannelCount; ++c) {
      found[k][c] = wanted[k][c] + (found[k][c] - wanted[k][c]) / growth[k][c];
    }
  }
  return test::largest_difference(wanted, found);
}

// A lamp in the middle of the scene, and a dim sky: patches of full light beside dark ones.
void expect_light_of_the_processor(const std::shared_ptr<const TransferData>& data) {
  const Light lamp = lamp_in_the_middle(*data);
  Engine engine(data);
  engine.relight({&lamp, 1}, {.luminance = 1});
  const FrameLight found = light_of_the_card(engine);

  // The card has the stored values, and rounds sums of floats alone.
  EXPECT_LE(test::largest_difference(exact_irradiance(engine), found.indirect), 1e-4);
  Engine floats(in_floats(*data));
  floats.relight({&lamp, 1}, engine.sky());
  const std::array<double, 5> of_floats = FrameLight(floats).differences(found);
  for (const double difference : of_floats) EXPECT_LE(difference, 1e-4);
  testing::Test::RecordProperty("from floats", std::to_string(std::ranges::max(of_floats)));

  // The processor rounds the light to integers too.
  const FrameLight rounded(engine);
  const auto [indirect, radiosity, at_vertices, at_texels, at_probes] = rounded.differences(found);
  const std::vector<Float3> growth = growth_at_vertices(data->mesh);
  std::vector<Float3> texel_growth(found.texels.size());
  interpolate_at_texels(data->lightmap, data->mesh, growth, texel_growth);
  for (Float3& g : texel_growth) {
    for (float& of_channel : g) of_channel = std::max(of_channel, 1.0F);
  }
  const double vertices = largest_difference_over(growth, rounded.vertices, found.vertices);
  const double texels = largest_difference_over(texel_growth, rounded.texels, found.texels);
  EXPECT_LE(indirect, 1e-3);
  EXPECT_LE(radiosity, 1e-3);
  EXPECT_LE(at_probes, 1e-3);
  EXPECT_LE(at_vertices, 6e-3);
  EXPECT_LE(at_texels, 6e-3);
  EXPECT_LE(vertices, 1e-3);
  EXPECT_LE(texels, 1e-3);
  testing::Test::RecordProperty("at patches and probes",
                                std::to_string(std::max({indirect, radiosity, at_probes})));
  testing::Test::RecordProperty("at vertices and texels",
                                std::to_string(std::max(at_vertices, at_texels)));
  testing::Test::RecordProperty("at vertices and texels, for their weights",
                                std::to_string(std::max(vertices, texels)));
  testing::Test::RecordProperty("largest sum of weights",
                                std::to_string(std::ranges::max(growth)[0]));
}

/// Expects the light of `lamp` with its shadow map to be that of shadow rays, to a part of it in
/// the area-weighted norm.
void expect_direct_light(const TransferData& data, Engine& engine, GpuEngine& gpu,
                         const GpuLamp& lamp, double tolerance, const char* what) {
  engine.relight({&lamp.light, 1}, {});
  const test::LightBuffer found(data.patches.size());
  gpu.light_patches({&lamp, 1}, found.name());
  const double difference =
      relative_difference(found.read(), engine.direct_irradiance(), data.patches.area);
  EXPECT_GT(area_norm(engine.direct_irradiance(), data.patches.area), 0) << what;
  EXPECT_LE(difference, tolerance) << what;
  testing::Test::RecordProperty(what, std::to_string(difference));
}

/// Expects the light of all `lamps` to be the sum of what each gives.
void expect_sum(GpuEngine& gpu, std::span<const GpuLamp> lamps, std::size_t patch_count) {
  const test::LightBuffer found(patch_count);
  std::vector<Float3> sum(patch_count);
  for (const GpuLamp& lamp : lamps) {
    gpu.light_patches({&lamp, 1}, found.name());
    const std::vector<Float3> light = found.read();
    for (std::size_t i = 0; i < patch_count; ++i) {
      for (int c = 0; c < kChannelCount; ++c) sum[i][c] += light[i][c];
    }
  }
  gpu.light_patches(lamps, found.name());
  EXPECT_LE(test::largest_difference(sum, found.read()), 1e-5);
}

void expect_light_of_shadow_rays(const std::shared_ptr<const TransferData>& data) {
  Engine engine(data);
  GpuEngine gpu(data, eglGetProcAddress);
  test::ShadowMaps maps(*data);
  constexpr int kSide = 1024;
  constexpr double kTolerance = 0.02;
  Light point = lamp_in_the_middle(*data);
  point.range = 2 * maps.diagonal();
  std::vector<GpuLamp> lamps = {maps.cube(point, kSide), maps.layers(point, kSide, true)};
  expect_direct_light(*data, engine, gpu, lamps[0], kTolerance, "point, cube");
  expect_direct_light(*data, engine, gpu, lamps[1], kTolerance, "point, six layers");
  Light spot = point;
  spot.type = LightType::kSpot;
  spot.direction = {0.6F, -0.64F, 0.48F};
  spot.inner_cone_angle = 0.3F;
  spot.outer_cone_angle = 0.7F;
  lamps.push_back(maps.plane(spot, kSide, false));
  expect_direct_light(*data, engine, gpu, lamps.back(), kTolerance, "spot");
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = {0.48F, -0.6F, 0.64F};
  engine.relight({&sun, 1}, {});
  const bool comes_in = area_norm(engine.direct_irradiance(), data->patches.area) > 0;
  if (comes_in) {
    lamps.push_back(maps.plane(sun, 2 * kSide, true));
    expect_direct_light(*data, engine, gpu, lamps.back(), kTolerance, "sun");
  }
  spot.direction = {-0.6F, 0.64F, -0.48F};
  lamps.push_back(maps.plane(spot, kSide, true));
  point.position[1] += 0.1F * maps.diagonal();
  lamps.push_back(maps.cube(point, kSide));
  expect_sum(gpu, lamps, data->patches.size());  // more than one run
}

/// What rows add to `count` receivers, by plain sums over what is stored.
std::vector<Float3> exact_rows(const TransferData& data, const ReceiverRows& rows,
                               std::size_t count, std::span<const Float3> radiosity) {
  std::vector<Float3> added(count);
  std::array<double, ReceiverRows::kGroup> sum;
  for (std::size_t g = 0; g < rows.group_count(); ++g) {
    for (int c = 0; c < kChannelCount; ++c) {
      sum = {};
      for (std::size_t e = rows.group_begin[g]; e < rows.group_begin[g + 1]; ++e) {
        double flux = 0, area = 0;
        const auto [begin, end] = rows.set[rows.entry_set[e]];
        for (std::size_t k = begin; k < end; ++k) {
          const std::uint32_t patch = rows.patch[k];
          flux += double{data.patches.area[patch]} * radiosity[patch][c];
          area += data.patches.area[patch];
        }
        for (std::size_t i = 0; i < sum.size(); ++i) {
          sum[i] += rows.value[ReceiverRows::value_index(e, i)] * rows.scale[e] * flux / area;
        }
      }
      for (std::size_t i = 0; i < sum.size(); ++i) {
        const std::uint32_t receiver = rows.receiver[g * sum.size() + i];
        if (receiver != kNone) added[receiver][c] = static_cast<float>(sum[i]);
      }
    }
  }
  return added;
}

/// Adds them, and expects that they make a difference.
void add_rows(const TransferData& data, const ReceiverRows& rows, std::span<const Float3> radiosity,
              std::vector<Float3>& light) {
  const std::vector<Float3> without = light;
  const std::vector<Float3> added = exact_rows(data, rows, light.size(), radiosity);
  for (std::size_t k = 0; k < light.size(); ++k) {
    for (int c = 0; c < kChannelCount; ++c) light[k][c] += added[k][c];
  }
  EXPECT_GT(test::largest_difference(without, light), 0.05);
}

// The processor rounds what the rows are multiplied with, the card does not. The rows of vertices
// stand for those of texels too: there are as many texels.
TEST(GpuReceiverRows, AreAddedAtVerticesAndTexels) {
  const test::GlContext context;
  if (!context.is_current()) GTEST_SKIP() << "there is no OpenGL 4.3 on this machine";
  const auto built = scene("furnished_room", true);
  ASSERT_GT(built->receiver_rows.group_count(), 1U);
  const auto data = std::make_shared<TransferData>(*built);
  data->texel_rows = data->receiver_rows;
  std::ranges::replace_if(
      data->texel_rows.receiver,
      [&](std::uint32_t k) {
        return k >= data->lightmap.triangle.size() || data->lightmap.triangle[k] == kNone;
      },
      kNone);
  const Light lamp = lamp_in_the_middle(*data);
  Engine engine(std::shared_ptr<const TransferData>{data});
  engine.relight({&lamp, 1}, {});
  const FrameLight found = light_of_the_card(engine);

  std::vector<Float3> vertices(data->mesh.position.size()), texels(data->lightmap.triangle.size());
  reconstruct_at_vertices(data->mesh, found.indirect, vertices);
  add_rows(*data, data->receiver_rows, found.radiosity, vertices);
  interpolate_at_texels(data->lightmap, data->mesh, vertices, texels);
  add_rows(*data, data->texel_rows, found.radiosity, texels);
  clamp_light(vertices);
  clamp_light(texels);
  EXPECT_LE(test::largest_difference(vertices, found.vertices), 1e-5);
  EXPECT_LE(test::largest_difference(texels, found.texels), 1e-5);

  const FrameLight of_processor(engine);
  EXPECT_LE(test::largest_difference(of_processor.vertices, found.vertices), 6e-3);
  EXPECT_LE(test::largest_difference(of_processor.texels, found.texels), 6e-3);
}

TEST_P(GpuScenes, AreLitAsByTheProcessor) {
  const test::GlContext context;
  if (!context.is_current()) GTEST_SKIP() << "there is no OpenGL 4.3 on this machine";
  const auto data = scene(GetParam());
  expect_light_of_the_processor(data);
  expect_light_of_shadow_rays(data);
}

}  // namespace
}  // namespace rebounce::test_gpu_scenes
