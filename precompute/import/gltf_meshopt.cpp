#include "precompute/import/gltf_meshopt.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <array>
#include <nlohmann/json.hpp>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

using nlohmann::json;

constexpr std::array kExtensions{"KHR_meshopt_compression", "EXT_meshopt_compression"};

// The codec uses at least two bits for 16 bytes of vertices, and a byte for a triangle or an index.
constexpr std::size_t kMaxExpansion = 64;

// The extension object of a buffer or buffer view; null if it has none.
const json* meshopt_extension(const json& parent) {
  const auto extensions = parent.find("extensions");
  if (extensions == parent.end() || !extensions->is_object()) return nullptr;
  for (const char* name : kExtensions) {
    const auto found = extensions->find(name);
    if (found != extensions->end() && found->is_object()) return &*found;
  }
  return nullptr;
}

// The extension of one view; the types of its members are checked.
struct CompressedView {
  explicit CompressedView(const json& extension)
      : buffer(extension.at("buffer").get<std::size_t>()),
        offset(extension.value("byteOffset", std::size_t{0})),
        bytes(extension.at("byteLength").get<std::size_t>()),
        stride(extension.at("byteStride").get<std::size_t>()),
        count(extension.at("count").get<std::size_t>()),
        mode(extension.at("mode").get<std::string>()),
        filter(extension.value("filter", "NONE")) {}

  std::size_t decoded_bytes() const { return count * stride; }

  std::size_t buffer, offset, bytes, stride, count;
  std::string mode, filter;
};

bool allows_stride(const CompressedView& view) {
  if (view.mode != "ATTRIBUTES") return view.stride == 2 || view.stride == 4;
  if (view.filter == "OCTAHEDRAL") return view.stride == 4 || view.stride == 8;
  if (view.filter == "QUATERNION") return view.stride == 8;
  return view.stride % 4 == 0 && view.stride > 0 && view.stride <= 256;
}

// meshoptimizer does not check any of this.
void check_layout(const CompressedView& view) {
  if (view.mode != "ATTRIBUTES" && view.mode != "TRIANGLES" && view.mode != "INDICES") {
    throw Error(fmt::format("its mode \"{}\" is unknown", view.mode));
  }
  const bool known_filter = view.filter == "NONE" || view.filter == "OCTAHEDRAL" ||
                            view.filter == "QUATERNION" || view.filter == "EXPONENTIAL";
  if (!known_filter) {
    throw Error(fmt::format("its filter \"{}\" is not supported; export it without that filter",
                            view.filter));
  }
  if (view.filter != "NONE" && view.mode != "ATTRIBUTES") {
    throw Error(fmt::format("a filter does not go with mode {}", view.mode));
  }
  if (!allows_stride(view)) {
    throw Error(fmt::format("its byteStride {} does not go with mode {} and filter {}", view.stride,
                            view.mode, view.filter));
  }
  if (view.mode == "TRIANGLES" && view.count % 3 != 0) {
    throw Error(fmt::format("its count {} is not of whole triangles", view.count));
  }
}

// The first byte of a stream names codec and version. The linked library does not read vertex
// streams from version 1 on.
void check_version(Bytes compressed) {
  constexpr std::uint8_t kVertexCodec = 0xA0;
  if (compressed.empty() || (compressed[0] & 0xF0) != kVertexCodec) return;
  if (const int version = compressed[0] & 0x0F; version > 0) {
    throw Error(
        fmt::format("its vertex codec is of version {}, which is not supported; export it with "
                    "version 0 (EXT_meshopt_compression)",
                    version));
  }
}

int decode(const CompressedView& view, Bytes from, std::uint8_t* to) {
  if (view.mode == "ATTRIBUTES") {
    return meshopt_decodeVertexBuffer(to, view.count, view.stride, from.data(), from.size());
  }
  if (view.mode == "TRIANGLES") {
    return meshopt_decodeIndexBuffer(to, view.count, view.stride, from.data(), from.size());
  }
  return meshopt_decodeIndexSequence(to, view.count, view.stride, from.data(), from.size());
}

void apply_filter(const CompressedView& view, std::uint8_t* elements) {
  if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(elements, view.count, view.stride);
  if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(elements, view.count, view.stride);
  if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(elements, view.count, view.stride);
}

std::vector<std::uint8_t> decoded(const Document& document, const CompressedView& view) {
  check_layout(view);
  const Bytes buffer = document.buffers.at(view.buffer);
  if (view.offset > buffer.size() || view.bytes > buffer.size() - view.offset) {
    throw Error(fmt::format("its compressed bytes {} to {} are not inside buffers[{}] of {} bytes",
                            view.offset, view.offset + view.bytes, view.buffer, buffer.size()));
  }
  const Bytes compressed = buffer.subspan(view.offset, view.bytes);
  check_version(compressed);
  if (view.decoded_bytes() > kMaxExpansion * compressed.size()) {
    throw Error(fmt::format("it claims {} bytes from {} compressed ones", view.decoded_bytes(),
                            compressed.size()));
  }
  std::vector<std::uint8_t> elements(view.decoded_bytes());
  if (view.count == 0) return elements;
  if (decode(view, compressed, elements.data()) != 0) throw Error("its data are damaged");
  apply_filter(view, elements.data());
  return elements;
}

bool has_fallback(const Document& document, std::size_t view) {
  const auto& source = document.model.bufferViews.at(view);
  const std::size_t size = document.buffers.at(static_cast<std::size_t>(source.buffer)).size();
  return source.byteOffset <= size && source.byteLength <= size - source.byteOffset;
}

// Views may overlap: all together must not declare more than all of the data could expand to.
void check_total(const json& views, const Document& document) {
  std::size_t available = 0;
  for (const Bytes buffer : document.buffers) available += buffer.size();
  std::size_t room = kMaxExpansion * available;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const json* extension = meshopt_extension(views[i]);
    if (!extension) continue;
    const std::size_t bytes = CompressedView(*extension).decoded_bytes();
    if (bytes > room) {
      throw Error(
          fmt::format("bufferViews[{}]: the compressed views up to here claim more than {} times "
                      "the {} bytes of the buffers",
                      i, kMaxExpansion, available));
    }
    room -= bytes;
  }
}

}  // namespace

bool is_meshopt_fallback(const json& buffer) {
  const json* extension = meshopt_extension(buffer);
  if (!extension) return false;
  const auto fallback = extension->find("fallback");
  return fallback != extension->end() && fallback->is_boolean() && fallback->get<bool>();
}

void decode_meshopt_views(const json& root, Document& document, Warnings& warnings) {
  if (!root.contains("bufferViews")) return;
  const json& views = root.at("bufferViews");
  check_total(views, document);
  document.decoded_views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const json* extension = meshopt_extension(views[i]);
    if (!extension) continue;
    try {
      document.decoded_views[i] =
          document.storage.emplace_back(decoded(document, CompressedView(*extension)));
    } catch (const Error& failure) {
      if (!has_fallback(document, i)) {
        throw Error(fmt::format("bufferViews[{}] (meshopt): {}", i, failure.what()));
      }
      warnings.count("{} meshopt buffer views cannot be decoded; their fallback is used");
    }
  }
}

}  // namespace rebounce::gltf
