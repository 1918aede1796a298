#include "precompute/import/gltf_draco.h"

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include <array>
#include <cstring>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

draco::DecoderBuffer buffer_over(Bytes encoded) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(encoded.data()), encoded.size());
  return buffer;
}

[[noreturn]] void refuse_damaged() {
  throw Error("its Draco data are damaged");
}

template <typename T>
T take(draco::DecoderBuffer& buffer) {
  T value{};
  if (!buffer.Decode(&value)) refuse_damaged();
  return value;
}

// The start of a Draco stream, read by the rules of the format (Draco bitstream 2.2, sections 3.1
// and 5.1).
class Header {
 public:
  explicit Header(Bytes encoded) : buffer_(buffer_over(encoded)) {
    for (const char expected : {'D', 'R', 'A', 'C', 'O'}) {
      if (take<char>(buffer_) != expected) throw Error("its data are not of Draco");
    }
    const auto major = take<std::uint8_t>(buffer_);
    const auto minor = take<std::uint8_t>(buffer_);
    version_ = DRACO_BITSTREAM_VERSION(major, minor);
    is_mesh_ = take<std::uint8_t>(buffer_) == draco::TRIANGULAR_MESH;
    method_ = take<std::uint8_t>(buffer_);
    has_metadata_ = (take<std::uint16_t>(buffer_) & METADATA_FLAG_MASK) != 0;
  }

  bool is_mesh() const { return is_mesh_; }

  // The number of triangles that the stream declares. The decoder would reserve memory for all of
  // them at once.
  std::uint32_t triangle_count() {
    if (has_metadata_) {
      draco::GeometryMetadata metadata;
      if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer_, &metadata)) refuse_damaged();
    }
    if (method_ == draco::MESH_EDGEBREAKER_ENCODING) {
      take<std::uint8_t>(buffer_);  // the kind of traversal
      if (version_ < DRACO_BITSTREAM_VERSION(2, 2)) read_count(2, 0);
      read_count(2, 0);  // vertices
      return read_count(2, 0);
    }
    return read_count(2, 2);
  }

 private:
  // Reads a count, whose length is variable from version `major`.`minor` on.
  std::uint32_t read_count(std::uint8_t major, std::uint8_t minor) {
    if (version_ < DRACO_BITSTREAM_VERSION(major, minor)) return take<std::uint32_t>(buffer_);
    std::uint32_t count = 0;
    if (!draco::DecodeVarint(&count, &buffer_)) refuse_damaged();
    return count;
  }

  draco::DecoderBuffer buffer_;
  std::uint16_t version_ = 0;
  bool is_mesh_ = false;
  std::uint8_t method_ = 0;
  bool has_metadata_ = false;
};

// The values of all points as T, tightly packed.
template <typename T>
std::vector<std::uint8_t> packed(const draco::PointAttribute& attribute, std::uint32_t points) {
  const auto components = static_cast<std::size_t>(attribute.num_components());
  std::array<T, 4> value{};
  std::vector<std::uint8_t> bytes(points * components * sizeof(T));
  for (std::uint32_t point = 0; point < points; ++point) {
    const auto index = attribute.mapped_index(draco::PointIndex(point));
    if (!attribute.ConvertValue<T>(index, value.data())) {
      throw Error(fmt::format("its Draco value {} does not fit the accessor's type", point));
    }
    std::memcpy(bytes.data() + point * components * sizeof(T), value.data(),
                components * sizeof(T));
  }
  return bytes;
}

std::vector<std::uint8_t> packed(const draco::PointAttribute& attribute, std::uint32_t points,
                                 int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return packed<std::int8_t>(attribute, points);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return packed<std::uint8_t>(attribute, points);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return packed<std::int16_t>(attribute, points);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return packed<std::uint16_t>(attribute, points);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return packed<float>(attribute, points);
    default:
      throw Error(fmt::format("the component type {} is not allowed", component_type));
  }
}

}  // namespace

DracoMesh::DracoMesh(Bytes encoded, std::size_t max_triangles) {
  Header header(encoded);
  if (!header.is_mesh()) throw Error("its Draco data are a point cloud");
  if (const std::uint32_t claimed = header.triangle_count(); claimed > max_triangles) {
    throw Error(fmt::format("its Draco data claim {} triangles where at most {} are expected",
                            claimed, max_triangles));
  }
  draco::DecoderBuffer buffer = buffer_over(encoded);
  auto mesh = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  if (!mesh.ok()) refuse_damaged();
  mesh_ = std::move(mesh).value();
}

DracoMesh::~DracoMesh() = default;

std::vector<std::uint32_t> DracoMesh::indices() const {
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * static_cast<std::size_t>(mesh_->num_faces()));
  for (std::uint32_t face = 0; face < mesh_->num_faces(); ++face) {
    for (const draco::PointIndex& vertex : mesh_->face(draco::FaceIndex(face))) {
      indices.push_back(vertex.value());
    }
  }
  return indices;
}

FloatElements DracoMesh::read_floats(std::uint32_t unique_id,
                                     const tinygltf::Accessor& accessor) const {
  const draco::PointAttribute* attribute = mesh_->GetAttributeByUniqueId(unique_id);
  if (!attribute) throw Error(fmt::format("its Draco data have no attribute {}", unique_id));
  const std::uint32_t points = mesh_->num_points();
  const std::size_t components = component_count(accessor.type);
  if (static_cast<std::size_t>(attribute->num_components()) != components) {
    throw Error(fmt::format("its Draco attribute {} has {} components instead of {}", unique_id,
                            attribute->num_components(), components));
  }
  const bool maps_every_point =
      attribute->is_mapping_identity() || attribute->indices_map_size() == points;
  if (!maps_every_point) refuse_damaged();
  return unpack_floats(accessor, packed(*attribute, points, accessor.componentType));
}

}  // namespace rebounce::gltf
