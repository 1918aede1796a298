#pragma once

#include <memory>

#include "precompute/import/gltf_accessors.h"

namespace draco {
class Mesh;
}

namespace rebounce::gltf {

/// A primitive's geometry, decoded from KHR_draco_mesh_compression: triangles over vertices.
class DracoMesh {
 public:
  /// Decodes `encoded`. Throws Error where that is no mesh of at most `max_triangles`, or damaged.
  DracoMesh(Bytes encoded, std::size_t max_triangles);
  ~DracoMesh();

  /// Three for each triangle. Not checked against the number of vertices.
  std::vector<std::uint32_t> indices() const;

  /// The attribute with this unique id, as `accessor` describes it: its type, component type and
  /// normalisation, not its count, which encoders that split vertices leave as it was. Throws Error
  /// where there is none or its values do not fit.
  FloatElements read_floats(std::uint32_t unique_id, const tinygltf::Accessor& accessor) const;

 private:
  std::unique_ptr<draco::Mesh> mesh_;
};

}  // namespace rebounce::gltf
