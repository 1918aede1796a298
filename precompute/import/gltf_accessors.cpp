#include "precompute/import/gltf_accessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

// The most elements that an accessor may have without data: zeros that a file need not hold, so
// that a small file can ask for them many times. More than any asset uses.
constexpr std::size_t kMaxUnbackedElements = std::size_t{1} << 20;

static_assert(std::endian::native == std::endian::little, "glTF data is little-endian");

// Elements of a known size at a regular distance, all checked to be in range.
struct Strided {
  const std::uint8_t* first = nullptr;
  std::size_t stride = 0;

  const std::uint8_t* operator[](std::size_t element) const { return first + element * stride; }
};

std::size_t component_bytes(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      throw Error(fmt::format("the component type {} is not allowed", component_type));
  }
}

// `count` elements of `element_bytes` each, from `byte_offset` in a view, or Error.
Strided checked_elements(const Document& document, int buffer_view, std::size_t byte_offset,
                         std::size_t count, std::size_t element_bytes, std::size_t stride) {
  const Bytes view = view_bytes(document, buffer_view);
  if (stride == 0) stride = element_bytes;
  if (stride < element_bytes) {
    throw Error(fmt::format("bufferViews[{}].byteStride {} is smaller than an element of {} bytes",
                            buffer_view, stride, element_bytes));
  }
  // Division avoids the overflow of a product: count comes from the file.
  const bool starts_inside = byte_offset <= view.size();
  const std::size_t room = starts_inside ? view.size() - byte_offset : 0;
  const bool ends_inside =
      count == 0 || (room >= element_bytes && (room - element_bytes) / stride >= count - 1);
  if (!starts_inside || !ends_inside) {
    throw Error(
        fmt::format("{} elements of {} bytes from byte {} do not fit in bufferViews[{}] of "
                    "{} bytes",
                    count, element_bytes, byte_offset, buffer_view, view.size()));
  }
  return {view.data() + byte_offset, stride};
}

// Gathers the raw elements of an accessor, tightly packed, with sparse ones replaced.
class RawElements {
 public:
  RawElements(const Document& document, const tinygltf::Accessor& accessor)
      : document_(document),
        accessor_(accessor),
        element_bytes_(component_bytes(accessor.componentType) * component_count(accessor.type)) {}

  std::vector<std::uint8_t> read() const {
    std::vector<std::uint8_t> packed;
    if (accessor_.bufferView >= 0) {
      const Strided source = checked_elements(
          document_, accessor_.bufferView, accessor_.byteOffset, accessor_.count, element_bytes_,
          document_.model.bufferViews[static_cast<std::size_t>(accessor_.bufferView)].byteStride);
      packed.resize(accessor_.count * element_bytes_);
      for (std::size_t i = 0; i < accessor_.count; ++i) replace(packed, i, source[i]);
    } else if (accessor_.count <= kMaxUnbackedElements) {
      packed.resize(accessor_.count * element_bytes_);
    } else {
      throw Error(fmt::format("it claims {} elements without any data", accessor_.count));
    }
    if (accessor_.sparse.isSparse) replace_sparse(packed);
    return packed;
  }

 private:
  void replace(std::vector<std::uint8_t>& packed, std::size_t element,
               const std::uint8_t* value) const {
    std::memcpy(packed.data() + element * element_bytes_, value, element_bytes_);
  }

  void replace_sparse(std::vector<std::uint8_t>& packed) const {
    const auto& sparse = accessor_.sparse;
    const auto count = static_cast<std::size_t>(sparse.count);
    const std::size_t index_bytes = component_bytes(sparse.indices.componentType);
    const Strided indices = checked_elements(document_, sparse.indices.bufferView,
                                             static_cast<std::size_t>(sparse.indices.byteOffset),
                                             count, index_bytes, 0);
    const Strided values = checked_elements(document_, sparse.values.bufferView,
                                            static_cast<std::size_t>(sparse.values.byteOffset),
                                            count, element_bytes_, 0);
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t element = 0;
      std::memcpy(&element, indices[i], index_bytes);
      if (element >= accessor_.count) {
        throw Error(fmt::format("its sparse index {} is {}, but it has {} elements", i, element,
                                accessor_.count));
      }
      replace(packed, element, values[i]);
    }
  }

  const Document& document_;
  const tinygltf::Accessor& accessor_;
  std::size_t element_bytes_;
};

template <typename Stored>
std::vector<float> converted(const std::vector<std::uint8_t>& packed, float scale) {
  std::vector<float> values(packed.size() / sizeof(Stored));
  for (std::size_t i = 0; i < values.size(); ++i) {
    Stored stored;
    std::memcpy(&stored, packed.data() + i * sizeof(Stored), sizeof(Stored));
    // Without the limit, the smallest signed value would be just below -1.
    const float value = static_cast<float>(stored) * scale;
    values[i] = scale == 1 ? value : std::max(value, -1.0F);
  }
  return values;
}

std::vector<float> to_floats(const std::vector<std::uint8_t>& packed,
                             const tinygltf::Accessor& accessor) {
  const auto scale = [&](float largest) { return accessor.normalized ? 1 / largest : 1.0F; };
  switch (accessor.componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return converted<std::int8_t>(packed, scale(127));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return converted<std::uint8_t>(packed, scale(255));
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return converted<std::int16_t>(packed, scale(32767));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return converted<std::uint16_t>(packed, scale(65535));
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return converted<float>(packed, 1);
    default:
      throw Error("it has 32-bit integers instead of 8-bit, 16-bit or float values");
  }
}

// Runs `read` and prepends the name of the accessor to the message of any Error.
template <typename Read>
auto with_name(int accessor, const Read& read) {
  try {
    return read();
  } catch (const Error& failure) {
    throw Error(fmt::format("accessors[{}]: {}", accessor, failure.what()));
  }
}

const tinygltf::Accessor& find(const Document& document, int accessor) {
  return document.model.accessors.at(static_cast<std::size_t>(accessor));
}

}  // namespace

std::size_t component_count(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    default:
      throw Error("it is a matrix instead of a scalar or vector");
  }
}

FloatElements unpack_floats(const tinygltf::Accessor& accessor,
                            const std::vector<std::uint8_t>& packed) {
  const bool is_float = accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
  const std::size_t components = component_count(accessor.type);
  return {packed.size() / (components * component_bytes(accessor.componentType)), components,
          !is_float && !accessor.normalized, to_floats(packed, accessor)};
}

FloatElements read_floats(const Document& document, int accessor) {
  return with_name(accessor, [&] {
    const auto& source = find(document, accessor);
    return unpack_floats(source, RawElements(document, source).read());
  });
}

std::vector<std::uint32_t> read_indices(const Document& document, int accessor) {
  return with_name(accessor, [&] {
    const auto& source = find(document, accessor);
    const int type = source.componentType;
    if (source.type != TINYGLTF_TYPE_SCALAR || (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
                                                type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
                                                type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)) {
      throw Error("indices must be unsigned scalars");
    }
    const auto packed = RawElements(document, source).read();
    const std::size_t bytes = component_bytes(type);
    std::vector<std::uint32_t> indices(source.count, 0);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      std::memcpy(&indices[i], packed.data() + i * bytes, bytes);
    }
    return indices;
  });
}

}  // namespace rebounce::gltf
