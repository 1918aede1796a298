// The importer over other people's files: every feature asset and scene has the number of triangles
// that the manifest states, every malformed file is imported or refused in one line.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "rebounce/precompute/import_gltf.h"
#include "rebounce/transfer/error.h"
#include "shared_folder.h"

namespace rebounce {
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
enum Column { kName = 0, kTriangles = 3, kLights = 8, kExtensions = 13, kRequired = 14 };

/// The extensions that the file requires and the importer does not have.
std::vector<std::string> unsupported(const std::vector<std::string>& row) {
  std::vector<std::string> names;
  for (const std::string& name : split(row[kRequired], ',')) {
    if (name == "EXT_meshopt_compression" || name == "KHR_meshopt_compression" ||
        name == "KHR_draco_mesh_compression" || name == "EXT_texture_webp") {
      names.push_back(name);
    }
  }
  return names;
}

/// Triangles that the importer should find: it takes one of gpu_instancing's instances.
std::size_t expected_triangles(const std::vector<std::string>& row) {
  if (row[kExtensions].find("EXT_mesh_gpu_instancing") != std::string::npos) return 12;
  return std::stoul(row[kTriangles]);
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
  EXPECT_EQ(scene.triangle.size() + scene.degenerate_triangle_count, expected_triangles(row));
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
    const auto missing = unsupported(row);
    if (!missing.empty()) {
      const std::string message = message_of(shared / row[kName]);
      EXPECT_TRUE(std::any_of(missing.begin(), missing.end(), [&](const std::string& name) {
        return message.find(name) != std::string::npos;
      })) << message;
      ++refused;
    } else if (expected_triangles(row) == 0) {
      EXPECT_NE(message_of(shared / row[kName]).find("no triangles"), std::string::npos);
    } else {
      expect_as_stated(shared / row[kName], row);
    }
  });
  EXPECT_GE(rows, 60);
  EXPECT_GE(refused, 9);
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
}  // namespace rebounce
