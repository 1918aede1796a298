#pragma once

#include <memory>

#include "precompute/import/gltf_accessors.h"

namespace draco {
class Mesh;
}

namespace rebounce::gltf {

/// The geometry of a primitive, decoded from KHR_draco_mesh_compression: triangles over vertices.
class DracoMesh {
 public:
  /// Decodes `encoded`. Throws Error if it is no mesh of at most `max_triangles`, or damaged.
  DracoMesh(Bytes encoded, std::size_t max_triangles);
  ~DracoMesh();

  /// Three per triangle. They are not checked against the number of vertices.
  std::vector<std::uint32_t> indices() const;

  /// The attribute with this unique id, with the type, component type and normalisation of
  /// `accessor`. Its count is ignored, because encoders that split vertices do not update it.
  /// Throws Error if there is no such attribute or its values do not fit.
  FloatElements read_floats(std::uint32_t unique_id, const tinygltf::Accessor& accessor) const;

 private:
  std::unique_ptr<draco::Mesh> mesh_;
};

}  // namespace rebounce::gltf
