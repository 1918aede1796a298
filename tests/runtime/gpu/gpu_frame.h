#pragma once

// A frame of both paths, compared.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/outputs.h"
#include "tests/gl/gl_context.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// The buffers that a frame reads and writes.
struct FrameBuffers {
  LightBuffer direct, indirect, radiosity, vertices;

  FrameBuffers(const TransferData& data, std::span<const Float3> direct_irradiance)
      : direct(direct_irradiance),
        indirect(data.patches.size()),
        radiosity(data.patches.size()),
        vertices(data.mesh.position.size()) {}

  GpuBuffers names() const {
    return {direct.name(), indirect.name(), radiosity.name(), vertices.name()};
  }
};

/// The largest difference of two arrays of light, as a part of the mean of the first.
inline double largest_difference(std::span<const Float3> wanted, std::span<const Float3> found) {
  double sum = 0, largest = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      sum += std::abs(double{wanted[i][c]});
      largest = std::max(largest, std::abs(double{wanted[i][c]} - found[i][c]));
      if (!std::isfinite(found[i][c])) largest = INFINITY;
    }
  }
  return largest / (sum / (kChannelCount * static_cast<double>(wanted.size())));
}

/// Expects the frame of the graphics card to be that of `engine`'s last one, to a thousandth of the
/// mean light.
inline void expect_frame_of(const Engine& engine, const FrameBuffers& buffers) {
  constexpr double kTolerance = 1e-3;  // what a frame on the card promises
  std::vector<Float3> at_vertices(engine.data().mesh.position.size());
  vertex_irradiance(engine, at_vertices);
  EXPECT_LE(largest_difference(engine.indirect_irradiance(), buffers.indirect.read()), kTolerance);
  EXPECT_LE(largest_difference(engine.radiosity(), buffers.radiosity.read()), kTolerance);
  EXPECT_LE(largest_difference(at_vertices, buffers.vertices.read()), kTolerance);
}

}  // namespace rebounce::test
