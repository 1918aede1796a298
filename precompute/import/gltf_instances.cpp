#include "precompute/import/gltf_instances.h"

#include <fmt/format.h>

#include "precompute/import/gltf_nodes.h"
#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

constexpr auto kExtension = "EXT_mesh_gpu_instancing";

std::optional<FloatElements> read_attribute(const Document& document,
                                            const tinygltf::Value& attributes, const char* name,
                                            std::size_t components) {
  if (!attributes.Has(name)) return {};
  FloatElements elements = read_floats(document, attributes.Get(name).GetNumberAsInt());
  if (elements.component_count != components) {
    throw Error(fmt::format("{} has {} components instead of {}", name, elements.component_count,
                            components));
  }
  return elements;
}

Instances read_attributes(const Document& document, const tinygltf::Value& attributes) {
  Instances instances;
  instances.translation = read_attribute(document, attributes, "TRANSLATION", 3);
  instances.rotation = read_attribute(document, attributes, "ROTATION", 4);
  instances.scale = read_attribute(document, attributes, "SCALE", 3);
  std::optional<std::size_t> count;
  for (const auto* elements : {&instances.translation, &instances.rotation, &instances.scale}) {
    if (!*elements) continue;
    if (count && *count != (*elements)->count) {
      throw Error(
          fmt::format("its attributes have {} and {} elements", *count, (*elements)->count));
    }
    count = (*elements)->count;
  }
  instances.count = count.value_or(1);
  return instances;
}

}  // namespace

glm::dmat4 Instances::transform(std::size_t i) const {
  Trs trs;
  for (int k = 0; k < 3; ++k) {
    const auto component = static_cast<std::size_t>(k);
    if (translation) trs.translation[k] = translation->at(i, component);
    if (scale) trs.scale[k] = scale->at(i, component);
  }
  for (int k = 0; k < 4; ++k) {
    if (rotation) trs.rotation[k] = rotation->at(i, static_cast<std::size_t>(k));
  }
  return trs.matrix();
}

Instances read_instances(const Document& document, std::size_t node) {
  const auto& extensions = document.model.nodes[node].extensions;
  const auto found = extensions.find(kExtension);
  if (found == extensions.end()) return {};
  try {
    return read_attributes(document, found->second.Get("attributes"));
  } catch (const Error& failure) {
    throw Error(fmt::format("nodes[{}] ({}): {}", node, kExtension, failure.what()));
  }
}

}  // namespace rebounce::gltf
