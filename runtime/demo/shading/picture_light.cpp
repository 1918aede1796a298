#include "runtime/demo/shading/picture_light.h"

#include <string>

#include "rebounce/error.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"
#include "transfer/operator/receiver_products.h"

namespace rebounce {
namespace {

/// Values at the vertices, which may be below 0: some weights are negative.
std::vector<Float3> mixed(const DisplayMesh& mesh, std::span<const glm::vec3> patch_value) {
  std::vector<Float3> value(mesh.position.size(), Float3{0, 0, 0});
  if (patch_value.empty() || mesh.weight_begin.empty()) return value;
  for (std::size_t v = 0; v < value.size(); ++v) {
    glm::vec3 sum(0);
    for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
      sum += mesh.weight[k] * patch_value[mesh.weight_patch[k]];
    }
    value[v] = to_float3(sum);
  }
  return value;
}

std::vector<glm::vec3> clamped(std::span<const Float3> value) {
  std::vector<glm::vec3> result;
  result.reserve(value.size());
  for (const Float3& v : value) result.push_back(glm::max(to_glm(v), glm::vec3(0)));
  return result;
}

}  // namespace

void check_length(std::size_t length, std::size_t patch_count, const char* name) {
  if (length == 0 || length == patch_count) return;
  throw Error("picture: " + std::string(name) + " has " + std::to_string(length) + " entries for " +
              std::to_string(patch_count) + " patches; give one for each");
}

VertexLight light_at_vertices(const TransferData& data, const PictureLight& light) {
  const std::size_t n = data.patches.size();
  check_length(light.indirect_irradiance.size(), n, "indirect_irradiance");
  check_length(light.emitted_irradiance.size(), n, "emitted_irradiance");
  check_length(light.reflected_exitance.size(), n, "reflected_exitance");
  check_sky(light.sky, data);
  std::vector<glm::vec3> sky(n), bounced(n, glm::vec3(0));
  for (std::size_t i = 0; i < n; ++i) {
    sky[i] = to_glm(sky_irradiance(data, light.sky, i));
    if (!light.indirect_irradiance.empty()) bounced[i] = to_glm(light.indirect_irradiance[i]);
    if (!light.emitted_irradiance.empty()) bounced[i] -= to_glm(light.emitted_irradiance[i]);
    // The error of the operator may make this slightly negative.
    bounced[i] = glm::max(bounced[i], glm::vec3(0));
  }
  VertexLight at_vertices{reconstruct_at_vertices(data.mesh, sky), {}};
  std::vector<Float3> value = mixed(data.mesh, bounced);
  if (!light.reflected_exitance.empty()) {
    ReceiverProducts(data.receiver_rows, data.patches.area).add(light.reflected_exitance, value);
  }
  at_vertices.bounced = clamped(value);
  return at_vertices;
}

std::vector<Float3> added_at_texels(const TransferData& data, const PictureLight& light) {
  check_length(light.reflected_exitance.size(), data.patches.size(), "reflected_exitance");
  if (data.texel_rows.empty() || light.reflected_exitance.empty()) return {};
  std::vector<Float3> added(data.lightmap.triangle.size(), Float3{0, 0, 0});
  ReceiverProducts(data.texel_rows, data.patches.area).add(light.reflected_exitance, added);
  return added;
}

std::vector<Float3> reflected_exitance(const Engine& engine) {
  std::vector<Float3> reflected(engine.radiosity().begin(), engine.radiosity().end());
  for (std::size_t i = 0; i < reflected.size(); ++i) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      reflected[i][c] -= engine.emitted_exitance()[i][c];
    }
  }
  return reflected;
}

std::vector<glm::vec3> reconstruct_at_vertices(const DisplayMesh& mesh,
                                               std::span<const glm::vec3> patch_value) {
  return clamped(mixed(mesh, patch_value));
}

glm::vec3 interpolate(const DisplayMesh& mesh, std::span<const glm::vec3> vertex_value,
                      const SurfacePoint& point) {
  const Uint3& corner = mesh.triangle[point.triangle];
  return point.weight.x * vertex_value[corner[0]] + point.weight.y * vertex_value[corner[1]] +
         point.weight.z * vertex_value[corner[2]];
}

}  // namespace rebounce
