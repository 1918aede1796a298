// The lit mesh against light that is known in closed form, and its file by the rules of glTF 2.0.

#include "runtime/demo/bake/lit_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "rebounce/error.h"
#include "runtime/demo/bake/glb_file.h"
#include "runtime/demo/bake/subdivided_mesh.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/rectangle_scene.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_lit_mesh {
namespace {

using nlohmann::json;
using test::floor_corners;
using test::SceneBuilder;

constexpr float kPi = std::numbers::pi_v<float>;

Light sun(float lux) {
  Light light;
  light.type = LightType::kDirectional;
  light.direction = {0, -1, 0};
  light.intensity = lux;
  return light;
}

LitMeshSettings unexposed(std::size_t triangles) {
  LitMeshSettings settings;
  settings.exposure = 0;
  settings.triangle_target = triangles;
  return settings;
}

LitMesh lit(const TransferData& data, const std::vector<Light>& lights,
            const LitMeshSettings& settings) {
  return light_mesh(data, make_surface_tracer(data.mesh), {.lights = lights}, Camera{}, settings);
}

TEST(LitMesh, ShowsWhatAnOpenFloorReflects) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({0.5F, 0.25F, 0.1F}));
  const LitMesh mesh = lit(scene.data(), {sun(3)}, unexposed(50));
  ASSERT_EQ(mesh.index.size(), 3U * 50);
  for (const Float3& color : mesh.color) {
    EXPECT_NEAR(color[0], 3 * 0.5F / kPi, 1e-5F);
    EXPECT_NEAR(color[1], 3 * 0.25F / kPi, 1e-5F);
    EXPECT_NEAR(color[2], 3 * 0.1F / kPi, 1e-5F);
  }
}

TEST(LitMesh, DoublesWithEachStopUntilTheShoulder) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({0.5F, 0.5F, 0.5F}));
  LitMeshSettings settings = unexposed(2);
  const float once = lit(scene.data(), {sun(1)}, settings).color[0][0];
  settings.exposure = 1;
  const LitMesh twice = lit(scene.data(), {sun(1)}, settings);
  EXPECT_NEAR(twice.color[0][0], 2 * once, 1e-5F);
  EXPECT_EQ(twice.exposure, 1);
  settings.exposure = 20;
  const float bright = lit(scene.data(), {sun(1)}, settings).color[0][0];
  EXPECT_GT(bright, 0.99F);
  EXPECT_LE(bright, 1);
}

TEST(LitMesh, HasTheShadowOfWhatHangsAbove) {
  SceneBuilder scene;
  const std::uint32_t material = scene.add_material({0.5F, 0.5F, 0.5F});
  scene.add_rectangle(floor_corners(1), material);
  scene.add_rectangle({{{-0.5F, 1, 0.5F}, {0.5F, 1, 0.5F}, {0.5F, 1, -0.5F}, {-0.5F, 1, -0.5F}}},
                      material);
  scene.make_double_sided();
  const LitMesh mesh = lit(scene.data(), {sun(3)}, unexposed(4000));
  int dark = 0, bright = 0, border = 0;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Float3& p = mesh.position[v];
    if (p[1] != 0) continue;
    const float reach = std::max(std::abs(p[0]), std::abs(p[2]));
    const float value = mesh.color[v][0];
    if (value != 0 && reach < 0.4F) {
      ADD_FAILURE() << "light in the shadow at " << p[0] << ", " << p[2];
    } else if (reach < 0.4F) {
      ++dark;
    } else if (reach > 0.6F && value > 0) {
      EXPECT_NEAR(value, 3 * 0.5F / kPi, 1e-5F);
      ++bright;
    } else {
      ++border;
    }
  }
  EXPECT_GT(dark, 50);
  EXPECT_GT(bright, 50);
  EXPECT_GT(border, 10);
}

TEST(LitMesh, DimsEmittersButKeepsTheirHue) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({0, 0, 0}, {1000, 500, 500}));
  const LitMesh mesh = lit(scene.data(), {}, unexposed(2));
  EXPECT_LT(mesh.color[0][1], 0.9F * mesh.color[0][0]);
  EXPECT_LE(mesh.color[0][0], 1);
}

TEST(LitMesh, IsTheSameForAnyNumberOfThreads) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({0.5F, 0.5F, 0.5F}));
  Light lamp;
  lamp.position = {0.3F, 0.4F, 0};
  const auto make = [&] { return lit(scene.data(), {lamp}, unexposed(2000)); };
  const LitMesh one = test::with_threads(1, make), three = test::with_threads(3, make);
  EXPECT_EQ(one.color, three.color);
  EXPECT_EQ(one.position, three.position);
}

TEST(LitMesh, RefusesNoSamples) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({0.5F, 0.5F, 0.5F}));
  LitMeshSettings settings;
  settings.samples_per_vertex = 0;
  EXPECT_THROW(lit(scene.data(), {}, settings), Error);
}

// Two rectangles that share an edge by position, with vertices of their own.
SceneBuilder folded_scene() {
  SceneBuilder scene;
  const std::uint32_t a = scene.add_material({0.5F, 0.5F, 0.5F});
  const std::uint32_t b = scene.add_material({0.2F, 0.5F, 0.5F});
  scene.add_rectangle({{{0, 0, 0.7F}, {0.3F, 0, 0.7F}, {0.3F, 0, 0}, {0, 0, 0}}}, a);
  scene.add_rectangle({{{0, 0, 0}, {0.3F, 0, 0}, {0.3F, 0.9F, 0.1F}, {0, 0.9F, 0.1F}}}, b);
  return scene;
}

TEST(SubdividedMesh, KeepsTheAreaAndHasNoTJunctions) {
  SceneBuilder scene = folded_scene();
  const DisplayMesh& display = scene.data().mesh;
  const LitMesh whole = lit(scene.data(), {}, unexposed(1));
  const LitMesh cut = lit(scene.data(), {}, unexposed(4 * 25));
  EXPECT_EQ(subdivide(display, 5).triangle.size(), 25 * display.triangle.size());
  const auto area = [](const LitMesh& mesh) {
    double sum = 0;
    for (const LitMesh::Part& part : mesh.part) {
      for (std::uint32_t k = part.index_begin; k < part.index_end; k += 3) {
        const auto at = [&](std::uint32_t c) {
          return to_dvec3(mesh.position[part.vertex_begin + mesh.index[k + c]]);
        };
        sum += 0.5 * glm::length(glm::cross(at(1) - at(0), at(2) - at(0)));
      }
    }
    return sum;
  };
  EXPECT_NEAR(area(cut), area(whole), 1e-6);
  // Seen by position, every edge inside has two triangles; the outline has 2 (h + w) = 6 sides
  // of 5.
  std::map<std::set<Float3>, int> edges;
  for (const LitMesh::Part& part : cut.part) {
    for (std::uint32_t k = part.index_begin; k < part.index_end; ++k) {
      const std::uint32_t next = k % 3 == 2 ? k - 2 : k + 1;
      ++edges[{cut.position[part.vertex_begin + cut.index[k]],
               cut.position[part.vertex_begin + cut.index[next]]}];
    }
  }
  const auto count = [&](int triangles) {
    return std::ranges::count_if(edges, [&](const auto& e) { return e.second == triangles; });
  };
  EXPECT_EQ(count(1), 6 * 5);
  EXPECT_EQ(count(2), (3 * 100 - 6 * 5) / 2);
}

// A .glb taken apart, with what every file must fulfil checked on the way.
struct Glb {
  json document;
  std::string binary;

  explicit Glb(const std::vector<std::byte>& bytes) {
    const std::string file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, &file.at(at), sizeof(value));
      return value;
    };
    EXPECT_EQ(file.substr(0, 4), "glTF");
    EXPECT_EQ(word(4), 2U);
    EXPECT_EQ(word(8), file.size());
    const std::size_t json_size = word(12);
    EXPECT_EQ(json_size % 4, 0U);
    EXPECT_EQ(file.substr(16, 4), "JSON");
    document = json::parse(file.substr(20, json_size));
    const std::size_t binary_size = word(20 + json_size);
    EXPECT_EQ(binary_size % 4, 0U);
    EXPECT_EQ(file.substr(24 + json_size, 4), std::string("BIN\0", 4));
    binary = file.substr(28 + json_size);
    EXPECT_EQ(binary.size(), binary_size);
    const std::size_t length = document["buffers"][0]["byteLength"];
    EXPECT_LE(length, binary_size);
    EXPECT_LT(binary_size - length, 4U);
  }

  // The components of an accessor; checks its place, alignment and size.
  template <typename T>
  std::vector<T> values(std::size_t accessor, std::size_t components, int target) const {
    const json& a = document["accessors"].at(accessor);
    const json& view = document["bufferViews"].at(a["bufferView"].get<std::size_t>());
    EXPECT_EQ(view["target"], target);
    const std::size_t view_offset = view["byteOffset"], offset = a["byteOffset"],
                      count = a["count"];
    const std::size_t stride = view.value("byteStride", components * sizeof(T));
    EXPECT_EQ((view_offset + offset) % 4, 0U);
    EXPECT_EQ(stride % 4, 0U);
    EXPECT_GE(count, 1U);
    EXPECT_LE(offset + stride * (count - 1) + components * sizeof(T),
              view["byteLength"].get<std::size_t>());
    EXPECT_LE(view_offset + view["byteLength"].get<std::size_t>(), binary.size());
    std::vector<T> values(count * components);
    for (std::size_t k = 0; k < count; ++k) {
      std::memcpy(&values[k * components], &binary.at(view_offset + offset + stride * k),
                  components * sizeof(T));
    }
    return values;
  }
};

constexpr int kVertices = 34962, kIndices = 34963;

void expect_sound_primitive(const Glb& glb, const json& primitive) {
  const json& attributes = primitive["attributes"];
  const auto positions = glb.values<float>(attributes["POSITION"], 3, kVertices);
  const json& accessor = glb.document["accessors"][attributes["POSITION"].get<std::size_t>()];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = positions[axis], high = positions[axis];
    for (std::size_t k = axis; k < positions.size(); k += 3) {
      EXPECT_TRUE(std::isfinite(positions[k]));
      low = std::min(low, positions[k]);
      high = std::max(high, positions[k]);
    }
    EXPECT_EQ(accessor["min"][axis].get<float>(), low);
    EXPECT_EQ(accessor["max"][axis].get<float>(), high);
  }
  const std::size_t vertex_count = positions.size() / 3;
  const json& color = glb.document["accessors"][attributes["COLOR_0"].get<std::size_t>()];
  EXPECT_EQ(color["componentType"], 5123);
  EXPECT_EQ(color["normalized"], true);
  const auto colors = glb.values<std::uint16_t>(attributes["COLOR_0"], 4, kVertices);
  EXPECT_EQ(colors.size(), 4 * vertex_count);
  for (std::size_t k = 3; k < colors.size(); k += 4) EXPECT_EQ(colors[k], 65535);
  const auto indices = glb.values<std::uint32_t>(primitive["indices"], 1, kIndices);
  EXPECT_EQ(indices.size() % 3, 0U);
  EXPECT_LT(*std::ranges::max_element(indices), vertex_count);
  // Every vertex is used.
  EXPECT_EQ(std::set<std::uint32_t>(indices.begin(), indices.end()).size(), vertex_count);
  const json& material = glb.document["materials"][primitive["material"].get<std::size_t>()];
  EXPECT_TRUE(material["extensions"].contains("KHR_materials_unlit"));
  EXPECT_EQ(material["pbrMetallicRoughness"].contains("baseColorTexture"),
            attributes.contains("TEXCOORD_0"));
}

// A PNG by its first bytes, which are all that is looked at.
Texture some_texture() {
  Texture texture;
  texture.encoded = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 0, 0, 0};
  texture.wrap_s = TextureWrap::kMirroredRepeat;
  return texture;
}

glm::dvec3 forward_of(const json& rotation) {
  const glm::dvec3 axis(rotation[0], rotation[1], rotation[2]);
  const double w = rotation[3];
  const glm::dvec3 v(0, 0, -1);
  return v + 2.0 * glm::cross(axis, glm::cross(axis, v) + w * v);
}

TEST(GlbFile, KeepsTheRulesOfTheFormat) {
  SceneBuilder scene = folded_scene();
  const LitMesh mesh = lit(scene.data(), {sun(1)}, unexposed(200));
  const Glb glb(encode_glb(mesh, scene.data(), {}));
  EXPECT_EQ(glb.document["asset"]["version"], "2.0");
  EXPECT_EQ(glb.document["extensionsUsed"], json({"KHR_materials_unlit"}));
  const json& primitives = glb.document["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2U);
  for (const json& primitive : primitives) expect_sound_primitive(glb, primitive);
}

TEST(GlbFile, KeepsTexturesCamerasAndLights) {
  SceneBuilder scene = folded_scene();
  TransferData& data = scene.data();
  const LitMesh mesh = lit(data, {sun(1)}, unexposed(2));
  data.textures = {some_texture(), some_texture()};
  data.materials[1].base_color_texture = 1;
  data.materials[1].name = "oak \"A\"";
  data.cameras.push_back({.name = "door", .position = {1, 2, 3}});
  Light spot;
  spot.type = LightType::kSpot;
  spot.position = {0, 2, 0};
  spot.direction = {0.6F, -0.8F, 0};
  spot.color = {4, 2, 1};
  spot.intensity = 10;
  spot.range = 7;
  const std::vector<Light> lights = {spot, sun(5)};
  const Glb glb(encode_glb(mesh, data, lights));
  const json& document = glb.document;
  for (const json& p : document["meshes"][0]["primitives"]) expect_sound_primitive(glb, p);
  // Only the texture that is used, byte by byte.
  ASSERT_EQ(document["images"].size(), 1U);
  EXPECT_EQ(document["images"][0]["mimeType"], "image/png");
  const json& view = document["bufferViews"][document["images"][0]["bufferView"].get<int>()];
  EXPECT_EQ(view["byteLength"], data.textures[1].encoded.size());
  EXPECT_EQ(glb.binary.substr(view["byteOffset"], 4), "\x89PNG");
  EXPECT_EQ(document["samplers"][0]["wrapS"], 33648);
  EXPECT_EQ(document["materials"][1]["name"], "oak \"A\"");
  EXPECT_EQ(document["cameras"][0]["name"], "door");

  const json& entries = document["extensions"]["KHR_lights_punctual"]["lights"];
  ASSERT_EQ(entries.size(), 2U);
  // Colours are at most 1 there: the intensity takes the rest.
  EXPECT_EQ(entries[0]["color"], json({1.0, 0.5, 0.25}));
  EXPECT_EQ(entries[0]["intensity"], 40);
  EXPECT_EQ(entries[0]["range"], 7);
  EXPECT_EQ(entries[1]["type"], "directional");
  for (const json& node : document["nodes"]) {
    if (!node.contains("extensions")) continue;
    const auto k = node["extensions"]["KHR_lights_punctual"]["light"].get<std::size_t>();
    const glm::dvec3 off = forward_of(node["rotation"]) - to_dvec3(lights[k].direction);
    EXPECT_LT(glm::length(off), 1e-6);
  }
}

TEST(GlbFile, RefusesTexturesThatAreNoImages) {
  SceneBuilder scene = folded_scene();
  const LitMesh mesh = lit(scene.data(), {}, unexposed(2));
  scene.data().textures.push_back({.encoded = {'G', 'I', 'F'}});
  scene.data().materials[0].base_color_texture = 0;
  EXPECT_THROW(encode_glb(mesh, scene.data(), {}), Error);
}

TEST(GlbFile, IsWrittenWholeOrNotAtAll) {
  SceneBuilder scene = folded_scene();
  const LitMesh mesh = lit(scene.data(), {}, unexposed(2));
  const test::TemporaryFolder folder;
  const std::size_t bytes = write_glb(folder / "lit.glb", mesh, scene.data(), {});
  EXPECT_EQ(test::read_bytes(folder / "lit.glb").size(), bytes);
  EXPECT_EQ(folder.names().size(), 1U);
  EXPECT_THROW(write_glb(folder / "none" / "lit.glb", mesh, scene.data(), {}), Error);
  EXPECT_EQ(folder.names().size(), 1U);
}

}  // namespace
}  // namespace rebounce::test_lit_mesh
