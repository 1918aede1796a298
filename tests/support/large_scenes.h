#pragma once

// Scenes of millions of triangles, and what they take of memory.

#include <sys/resource.h>

#include <cmath>
#include <numbers>

#include "tests/support/gltf_builder.h"

namespace rebounce::test {

/// The most memory that this process has ever had.
inline double peak_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

/// A bumpy ball of 2 x rings x segments triangles, `instances` times. Without normals no vertex can
/// be shared, which takes the most memory.
inline GltfBuilder balls(int rings, int segments, int instances, bool with_normals) {
  std::vector<float> position;
  for (int ring = 0; ring <= rings; ++ring) {
    for (int segment = 0; segment <= segments; ++segment) {
      const double polar = std::numbers::pi * (ring + 0.5) / (rings + 1);
      const double around = 2 * std::numbers::pi * segment / (segments + 1);
      for (const double value : {std::sin(polar) * std::cos(around), std::cos(polar),
                                 std::sin(polar) * std::sin(around)}) {
        position.push_back(static_cast<float>(value));
      }
    }
  }
  std::vector<std::uint32_t> index;
  for (int ring = 0; ring < rings; ++ring) {
    for (int segment = 0; segment < segments; ++segment) {
      const auto a = static_cast<std::uint32_t>(ring * (segments + 1) + segment);
      const auto b = a + static_cast<std::uint32_t>(segments) + 1;
      index.insert(index.end(), {a, a + 1, b, b, a + 1, b + 1});
    }
  }
  std::vector<float> place;
  for (int i = 0; i < instances; ++i) {
    const int x = i % 10, y = i / 100, z = i / 10 % 10;
    for (const int step : {x, y, z}) place.push_back(3.0F * static_cast<float>(step));
  }
  GltfBuilder builder;
  const int positions = builder.add_accessor(position, "VEC3", 3);
  const int indices = builder.add_indices(index);
  builder.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}});
  if (with_normals) builder.primitive()["attributes"]["NORMAL"] = positions;
  builder.add_node({{"mesh", 0}});
  builder.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", builder.add_accessor(place, "VEC3", 3)}};
  return builder;
}

}  // namespace rebounce::test
