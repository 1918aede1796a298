// The importer over other people's files: every feature asset and scene has the number of triangles
// that the manifest states, every malformed file is imported or refused in one line.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/glm.hpp>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "precompute/import/import_gltf.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/shared_folder.h"

namespace rebounce::test_import_shared {
namespace {

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, separator);) cells.push_back(cell);
  return cells;
}

/// The rows of a tab-separated file below its heading.
std::vector<std::vector<std::string>> table(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) rows.push_back(split(line, '\t'));
  return rows;
}

// Columns of scenes_manifest.tsv.
enum Column { kName = 0, kTriangles = 3, kLights = 8 };

/// The Khronos test of meshopt has views of the codec's newer version and its colour filter.
bool needs_newer_meshopt(const std::vector<std::string>& row) {
  return row[kName].ends_with("MeshoptCubeTest.gltf");
}

void expect_sound(const Scene& scene) {
  const std::size_t vertices = scene.position.size();
  ASSERT_EQ(scene.normal.size(), vertices);
  ASSERT_EQ(scene.base_color_texcoord.size(), vertices);
  ASSERT_EQ(scene.emissive_texcoord.size(), vertices);
  ASSERT_EQ(scene.vertex_color.size(), vertices);
  ASSERT_EQ(scene.triangle_material.size(), scene.triangle.size());
  ASSERT_EQ(scene.images.size(), scene.textures.size());
  ASSERT_FALSE(scene.triangle.empty());
  for (const Uint3& triangle : scene.triangle) {
    for (const std::uint32_t vertex : triangle) ASSERT_LT(vertex, vertices);
  }
  for (const std::uint32_t material : scene.triangle_material) {
    ASSERT_LT(material, scene.materials.size());
  }
  for (const Float3& normal : scene.normal) {
    ASSERT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1.0, 1e-5);
  }
  for (const Material& material : scene.materials) {
    ASSERT_TRUE(material.base_color_texture == kNone ||
                material.base_color_texture < scene.textures.size());
    ASSERT_TRUE(material.emissive_texture == kNone ||
                material.emissive_texture < scene.textures.size());
  }
  for (const Image& image : scene.images) {
    ASSERT_EQ(image.rgba.size(), 4U * static_cast<std::size_t>(image.width * image.height));
  }
  for (const std::string& warning : scene.warnings) {
    ASSERT_EQ(warning.find('\n'), std::string::npos);
  }
  ASSERT_EQ(scene.hash.size(), 5U + 32U);
}

void expect_as_stated(const std::filesystem::path& file, const std::vector<std::string>& row) {
  const Scene scene = import_gltf(file);
  expect_sound(scene);
  EXPECT_EQ(scene.triangle.size() + scene.degenerate_triangle_count, std::stoul(row[kTriangles]));
  EXPECT_EQ(scene.lights.size(), std::stoul(row[kLights]));
}

std::string message_of(const std::filesystem::path& file) {
  try {
    import_gltf(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Runs `visit` on the manifest's rows whose name starts with `folder`; returns how many they were.
template <typename Visit>
int for_each_row(const std::filesystem::path& shared, const std::string& folder,
                 const Visit& visit) {
  int rows = 0;
  for (const auto& row : table(shared / "scenes_manifest.tsv")) {
    if (!row[kName].starts_with(folder)) continue;
    SCOPED_TRACE(row[kName]);
    visit(row);
    ++rows;
  }
  return rows;
}

TEST(ImportShared, FeatureFilesHaveTheTrianglesOfTheManifest) {
  const auto shared = test::shared_folder();
  REBOUNCE_NEED_SHARED(shared / "gltf_features");
  int refused = 0;
  const int rows = for_each_row(shared, "gltf_features/", [&](const auto& row) {
    if (needs_newer_meshopt(row)) {
      EXPECT_NE(message_of(shared / row[kName]).find("not supported"), std::string::npos);
      ++refused;
    } else if (std::stoul(row[kTriangles]) == 0) {
      EXPECT_NE(message_of(shared / row[kName]).find("no triangles"), std::string::npos);
    } else {
      expect_as_stated(shared / row[kName], row);
    }
  });
  EXPECT_GE(rows, 60);
  EXPECT_EQ(refused, 1);
}

/// Positions of an asset's triangles, as sums that do not depend on their order.
struct Shape {
  std::size_t triangles = 0;
  double area = 0;
  glm::dvec3 centroid{0.0};
  glm::dvec3 low{std::numeric_limits<double>::max()}, high{-std::numeric_limits<double>::max()};
};

Shape shape_of(const std::filesystem::path& file) {
  const Scene scene = import_gltf(file);
  Shape shape;
  shape.triangles = scene.triangle.size() + scene.degenerate_triangle_count;
  for (const Uint3& triangle : scene.triangle) {
    const glm::dvec3 a = to_dvec3(scene.position[triangle[0]]);
    const glm::dvec3 b = to_dvec3(scene.position[triangle[1]]);
    const glm::dvec3 c = to_dvec3(scene.position[triangle[2]]);
    const double area = glm::length(glm::cross(b - a, c - a)) / 2;
    shape.area += area;
    shape.centroid += area * (a + b + c) / 3.0;
    shape.low = glm::min(shape.low, glm::min(a, glm::min(b, c)));
    shape.high = glm::max(shape.high, glm::max(a, glm::max(b, c)));
  }
  shape.centroid /= shape.area;
  return shape;
}

/// One model, exported in three ways: as it is, quantised to 12 bits with meshopt, with Draco.
TEST(ImportShared, CompressedDucksAreTheSameDuck) {
  const auto folder = test::shared_folder() / "gltf_features";
  REBOUNCE_NEED_SHARED(folder);
  const Shape plain = shape_of(folder / "duck_plain.glb");
  const double tolerance = 1e-3 * glm::length(plain.high - plain.low);
  for (const char* name : {"quantized_meshopt_duck_12.glb", "duck_draco/Duck.gltf"}) {
    SCOPED_TRACE(name);
    const Shape duck = shape_of(folder / name);
    EXPECT_EQ(duck.triangles, plain.triangles);
    EXPECT_NEAR(duck.area, plain.area, 1e-3 * plain.area);
    EXPECT_LT(glm::length(duck.centroid - plain.centroid), tolerance);
    EXPECT_LT(glm::length(duck.low - plain.low), tolerance);
    EXPECT_LT(glm::length(duck.high - plain.high), tolerance);
  }
}

/// A lattice of cubes, five along each axis.
TEST(ImportShared, InstancesStandApart) {
  const auto file = test::shared_folder() / "gltf_features" / "gpu_instancing_125.glb";
  REBOUNCE_NEED_SHARED(file);
  const Scene scene = import_gltf(file);
  ASSERT_EQ(scene.triangle.size(), 1500U);
  std::set<std::array<long, 3>> places;
  for (std::size_t cube = 0; cube < 125; ++cube) {
    glm::dvec3 mean(0.0);
    for (std::size_t t = 12 * cube; t < 12 * (cube + 1); ++t) {
      for (const std::uint32_t vertex : scene.triangle[t]) {
        mean += to_dvec3(scene.position[vertex]) / 36.0;
      }
    }
    places.insert(
        {std::lround(1000 * mean.x), std::lround(1000 * mean.y), std::lround(1000 * mean.z)});
  }
  EXPECT_EQ(places.size(), 125U);
}

TEST(ImportShared, WebpIsDecodedAndKeptAsPng) {
  const auto folder = test::shared_folder() / "gltf_features";
  REBOUNCE_NEED_SHARED(folder);
  for (const char* name : {"webp_required/box-textured-separate.gltf",
                           "webp_fallback/box-textured-with-fallback.gltf"}) {
    SCOPED_TRACE(name);
    const Scene scene = import_gltf(folder / name);
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].width, 128);
    EXPECT_EQ(scene.textures[0].encoded[0], 0x89);  // stored as PNG
    EXPECT_TRUE(scene.warnings.empty());
  }
}

TEST(ImportShared, ScenesHaveTheTrianglesOfTheManifest) {
  const auto shared = test::shared_folder();
  REBOUNCE_NEED_SHARED(shared / "scenes");
  const int rows = for_each_row(
      shared, "scenes/", [&](const auto& row) { expect_as_stated(shared / row[kName], row); });
  EXPECT_GE(rows, 15);
}

TEST(ImportShared, MalformedFilesAreImportedOrRefusedInOneLine) {
  const auto folder = test::shared_folder() / "gltf_malformed";
  REBOUNCE_NEED_SHARED(folder);
  int files = 0;
  int imported = 0;
  for (const auto& row : table(folder / "INDEX.tsv")) {
    SCOPED_TRACE(row[0]);
    ++files;
    try {
      expect_sound(import_gltf(folder / row[0]));
      ++imported;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(row[0].substr(row[0].rfind('/') + 1)), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
  EXPECT_GE(files, 200);
  std::cout << imported << " of " << files << " files were imported\n";
}

}  // namespace
}  // namespace rebounce::test_import_shared
