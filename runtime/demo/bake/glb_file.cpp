// Binary glTF: the Khronos glTF 2.0 specification (3.6.2 accessors, 4.4 GLB), KHR_materials_unlit
// and KHR_lights_punctual.

#include "runtime/demo/bake/glb_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "rebounce/error.h"
#include "rebounce/version.h"
#include "runtime/demo/bake/punctual_light.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "transfer/file/atomic_file.h"

namespace rebounce {
namespace {

using nlohmann::json;

// glTF uses OpenGL's numbers for component types.
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr int kLinear = 9729, kLinearMipmapLinear = 9987;
constexpr int kRepeat = 10497, kClampToEdge = 33071, kMirroredRepeat = 33648;

constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8, kAlignment = 4;

constexpr double kNearPart = 1e-4;  // fraction of the scene's diagonal: the cameras' near plane

using Color16 = std::array<std::uint16_t, 4>;

std::size_t padded(std::size_t size) {
  return (size + kAlignment - 1) / kAlignment * kAlignment;
}

// The binary part of the file and its buffer views.
class Binary {
 public:
  // Returns the index of the new view. 0 leaves out `stride` or `target`.
  template <typename T>
  int add_view(std::span<const T> values, std::size_t stride, int target) {
    bytes_.resize(padded(bytes_.size()));
    json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", values.size_bytes()}};
    if (stride > 0) view["byteStride"] = stride;
    if (target > 0) view["target"] = target;
    const auto raw = std::as_bytes(values);
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    views_.push_back(std::move(view));
    return static_cast<int>(views_.size()) - 1;
  }

  const std::vector<std::byte>& bytes() const { return bytes_; }
  const json& views() const { return views_; }

 private:
  std::vector<std::byte> bytes_;
  json views_ = json::array();
};

std::vector<Color16> encode_colors(std::span<const Float3> color) {
  const auto encode = [](float value) {
    return static_cast<std::uint16_t>(std::lround(65535 * std::clamp(value, 0.0F, 1.0F)));
  };
  std::vector<Color16> encoded;
  encoded.reserve(color.size());
  for (const Float3& c : color)
    encoded.push_back({encode(c[0]), encode(c[1]), encode(c[2]), 65535});
  return encoded;
}

// [low, high] of positions; accessors require it.
std::array<Float3, 2> bounds_of(std::span<const Float3> position) {
  std::array<Float3, 2> bounds = {position.front(), position.front()};
  for (const Float3& p : position) {
    for (std::size_t k = 0; k < 3; ++k) {
      bounds[0][k] = std::min(bounds[0][k], p[k]);
      bounds[1][k] = std::max(bounds[1][k], p[k]);
    }
  }
  return bounds;
}

const char* mime_type(const Texture& texture) {
  static constexpr std::array<std::uint8_t, 4> kPng = {0x89, 'P', 'N', 'G'};
  static constexpr std::array<std::uint8_t, 3> kJpeg = {0xFF, 0xD8, 0xFF};
  const auto begins_with = [&](auto magic) {
    return texture.encoded.size() >= magic.size() &&
           std::ranges::equal(std::span(texture.encoded).first(magic.size()), magic);
  };
  if (begins_with(kPng)) return "image/png";
  if (begins_with(kJpeg)) return "image/jpeg";
  throw Error("texture: neither PNG nor JPEG; precompute the scene again from an intact file");
}

int wrap_code(TextureWrap wrap) {
  if (wrap == TextureWrap::kClampToEdge) return kClampToEdge;
  return wrap == TextureWrap::kMirroredRepeat ? kMirroredRepeat : kRepeat;
}

// The rotation as glTF's quaternion x, y, z, w.
json rotation(const glm::dmat3& axes) {
  const glm::dquat q = glm::normalize(glm::quat_cast(axes));
  return {q.x, q.y, q.z, q.w};
}

class GlbBuilder {
 public:
  GlbBuilder(const LitMesh& mesh, const TransferData& data) : mesh_(mesh), data_(data) {
    document_["asset"] = {{"version", "2.0"},
                          {"generator", std::string("rebounce ") + version()},
                          {"extras", {{"exposure", mesh.exposure}}}};
    document_["extensionsUsed"] = {"KHR_materials_unlit"};
    document_["nodes"] = json::array();
    add_mesh();
  }

  void add_cameras() {
    const auto [low, high] = bounds_of(mesh_.position);
    const double near = kNearPart * glm::distance(to_dvec3(low), to_dvec3(high));
    for (const Camera& camera : data_.cameras) {
      json entry = {{"type", "perspective"},
                    {"perspective", {{"yfov", camera.vertical_fov}, {"znear", near}}}};
      name(entry, camera.name);
      json node = {{"camera", document_["cameras"].size()},
                   {"translation", camera.position},
                   {"rotation", rotation({to_dvec3(camera.right), to_dvec3(camera.up),
                                          to_dvec3(camera.backward)})}};
      name(node, camera.name);
      document_["cameras"].push_back(std::move(entry));
      document_["nodes"].push_back(std::move(node));
    }
  }

  void add_lights(std::span<const Light> lights) {
    if (lights.empty()) return;
    document_["extensionsUsed"].push_back("KHR_lights_punctual");
    json& list = document_["extensions"]["KHR_lights_punctual"]["lights"];
    for (const Light& given : lights) {
      const Light light = punctual_equivalent(given);
      json node = {{"extensions", {{"KHR_lights_punctual", {{"light", list.size()}}}}}};
      if (light.type != LightType::kDirectional) node["translation"] = light.position;
      if (light.type != LightType::kPoint) {
        node["rotation"] = rotation(frame_around(glm::normalize(-to_dvec3(light.direction))));
      }
      name(node, light.name);
      list.push_back(entry_of(light));
      document_["nodes"].push_back(std::move(node));
    }
  }

  std::vector<std::byte> finish() {
    json roots = json::array();
    for (std::size_t k = 0; k < document_["nodes"].size(); ++k) roots.push_back(k);
    document_["scene"] = 0;
    document_["scenes"] = json::array({json{{"nodes", std::move(roots)}}});
    document_["bufferViews"] = binary_.views();
    document_["buffers"] = json::array({json{{"byteLength", binary_.bytes().size()}}});
    return pack(document_.dump(-1, ' ', false, json::error_handler_t::replace), binary_.bytes());
  }

 private:
  static void name(json& object, const std::string& text) {
    if (!text.empty()) object["name"] = text;
  }

  static json entry_of(const Light& light) {
    // glTF allows no colours beyond 1: the excess goes into the intensity.
    const float peak = std::max(1.0F, *std::ranges::max_element(light.color));
    json entry = {{"color", {light.color[0] / peak, light.color[1] / peak, light.color[2] / peak}},
                  {"intensity", light.intensity * peak}};
    name(entry, light.name);
    entry["type"] = lamp_kind(light.type).name;
    if (light.range > 0 && light.type != LightType::kDirectional) entry["range"] = light.range;
    if (light.type == LightType::kSpot) {
      // glTF wants at most pi / 2, which single precision rounds up, and less for the inner one.
      const double outer = std::min<double>(light.outer_cone_angle, std::numbers::pi / 2);
      const double inner = std::min<double>(light.inner_cone_angle, 0.999999 * outer);
      entry["spot"] = {{"innerConeAngle", inner}, {"outerConeAngle", outer}};
    }
    return entry;
  }

  void add_mesh() {
    const std::vector<Color16> color = encode_colors(mesh_.color);
    index_view_ =
        binary_.add_view(std::span<const std::uint32_t>(mesh_.index), 0, kElementArrayBuffer);
    position_view_ =
        binary_.add_view(std::span<const Float3>(mesh_.position), sizeof(Float3), kArrayBuffer);
    color_view_ = binary_.add_view(std::span<const Color16>(color), sizeof(Color16), kArrayBuffer);
    json primitives = json::array();
    for (const LitMesh::Part& part : mesh_.part) primitives.push_back(primitive(part));
    document_["meshes"] = json::array({json{{"primitives", std::move(primitives)}}});
    document_["nodes"].push_back({{"mesh", 0}});
  }

  json primitive(const LitMesh::Part& part) {
    json attributes = {
        {"POSITION", vertex_accessor(part, position_view_, sizeof(Float3), kFloat, "VEC3")},
        {"COLOR_0", vertex_accessor(part, color_view_, sizeof(Color16), kUnsignedShort, "VEC4")}};
    const auto [low, high] = bounds_of(
        std::span(mesh_.position).subspan(part.vertex_begin, part.vertex_end - part.vertex_begin));
    json& position = document_["accessors"][attributes["POSITION"].get<std::size_t>()];
    position["min"] = low;
    position["max"] = high;
    document_["accessors"][attributes["COLOR_0"].get<std::size_t>()]["normalized"] = true;
    if (is_textured(part)) {
      if (texcoord_view_ < 0) {
        texcoord_view_ =
            binary_.add_view(std::span<const Float2>(mesh_.texcoord), sizeof(Float2), kArrayBuffer);
      }
      attributes["TEXCOORD_0"] =
          vertex_accessor(part, texcoord_view_, sizeof(Float2), kFloat, "VEC2");
    }
    const int indices = add_accessor({{"bufferView", index_view_},
                                      {"byteOffset", sizeof(std::uint32_t) * part.index_begin},
                                      {"componentType", kUnsignedInt},
                                      {"count", part.index_end - part.index_begin},
                                      {"type", "SCALAR"}});
    document_["materials"].push_back(material_entry(part));
    return {{"attributes", std::move(attributes)},
            {"indices", indices},
            {"material", document_["materials"].size() - 1}};
  }

  int vertex_accessor(const LitMesh::Part& part, int view, std::size_t stride, int component,
                      const char* type) {
    return add_accessor({{"bufferView", view},
                         {"byteOffset", stride * part.vertex_begin},
                         {"componentType", component},
                         {"count", part.vertex_end - part.vertex_begin},
                         {"type", type}});
  }

  int add_accessor(json accessor) {
    document_["accessors"].push_back(std::move(accessor));
    return static_cast<int>(document_["accessors"].size()) - 1;
  }

  bool is_textured(const LitMesh::Part& part) const {
    return part.is_in_texture || data_.materials[part.material].base_color_texture != kNone;
  }

  json material_entry(const LitMesh::Part& part) {
    const Material& material = data_.materials[part.material];
    // A dull surface, for viewers without KHR_materials_unlit.
    json surface = {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}};
    if (is_textured(part)) {
      surface["baseColorTexture"] = {{"index", part.is_in_texture
                                                   ? lit_texture_index()
                                                   : texture_index(material.base_color_texture)}};
    }
    json entry = {{"extensions", {{"KHR_materials_unlit", json::object()}}}};
    const float alpha = material.base_alpha * (1 - material.transmitted());
    if (material.alpha_mode == AlphaMode::kMask) {
      entry["alphaMode"] = "MASK";
      entry["alphaCutoff"] = material.alpha_cutoff;
      surface["baseColorFactor"] = {1, 1, 1, material.base_alpha};
    } else if (material.alpha_mode == AlphaMode::kBlend || alpha < material.base_alpha) {
      entry["alphaMode"] = "BLEND";
      surface["baseColorFactor"] = {1, 1, 1, alpha};
    }
    entry["pbrMetallicRoughness"] = std::move(surface);
    name(entry, material.name);
    return entry;
  }

  // Textures are added to the file when they are first used.
  std::size_t texture_index(std::uint32_t texture) {
    const auto found = textures_.find(texture);
    if (found != textures_.end()) return found->second;
    const Texture& source = data_.textures[texture];
    const std::size_t index =
        add_texture(source.encoded, mime_type(source), source.wrap_s, source.wrap_t);
    textures_.emplace(texture, index);
    return index;
  }

  std::size_t lit_texture_index() {
    if (!lit_texture_) {
      lit_texture_ = add_texture(encode_png(mesh_.texture), "image/png", TextureWrap::kClampToEdge,
                                 TextureWrap::kClampToEdge);
    }
    return *lit_texture_;
  }

  std::size_t add_texture(std::span<const std::uint8_t> encoded, const char* mime,
                          TextureWrap wrap_s, TextureWrap wrap_t) {
    const std::size_t index = document_["textures"].size();
    const int view = binary_.add_view(encoded, 0, 0);
    document_["images"].push_back({{"bufferView", view}, {"mimeType", mime}});
    document_["samplers"].push_back({{"magFilter", kLinear},
                                     {"minFilter", kLinearMipmapLinear},
                                     {"wrapS", wrap_code(wrap_s)},
                                     {"wrapT", wrap_code(wrap_t)}});
    document_["textures"].push_back({{"source", index}, {"sampler", index}});
    return index;
  }

  static void append(std::vector<std::byte>& file, std::span<const std::byte> bytes) {
    file.insert(file.end(), bytes.begin(), bytes.end());
  }

  static void append_words(std::vector<std::byte>& file, std::initializer_list<std::size_t> words) {
    for (const std::size_t word : words) {
      for (int shift = 0; shift < 32; shift += 8) {
        file.push_back(static_cast<std::byte>(word >> shift & 0xFF));
      }
    }
  }

  static std::vector<std::byte> pack(const std::string& text, std::span<const std::byte> binary) {
    const std::size_t text_bytes = padded(text.size()), binary_bytes = padded(binary.size());
    const std::size_t total = kHeaderBytes + 2 * kChunkHeaderBytes + text_bytes + binary_bytes;
    if (total > std::numeric_limits<std::uint32_t>::max()) {
      throw Error("the lit scene is " + std::to_string(total >> 20) +
                  " MiB, more than a .glb can hold; ask for fewer triangles");
    }
    std::vector<std::byte> file;
    file.reserve(total);
    append_words(file, {kGlbMagic, 2, total, text_bytes, kJsonChunk});
    append(file, std::as_bytes(std::span(text)));
    file.resize(kHeaderBytes + kChunkHeaderBytes + text_bytes, std::byte{' '});
    append_words(file, {binary_bytes, kBinaryChunk});
    append(file, binary);
    file.resize(total);
    return file;
  }

  const LitMesh& mesh_;
  const TransferData& data_;
  json document_ = json::object();
  Binary binary_;
  int index_view_ = -1, position_view_ = -1, color_view_ = -1, texcoord_view_ = -1;
  std::map<std::uint32_t, std::size_t> textures_;
  std::optional<std::size_t> lit_texture_;
};

}  // namespace

std::vector<std::byte> encode_glb(const LitMesh& mesh, const TransferData& data,
                                  std::span<const Light> lights) {
  GlbBuilder builder(mesh, data);
  builder.add_cameras();
  builder.add_lights(lights);
  return builder.finish();
}

std::size_t write_glb(const std::filesystem::path& path, const LitMesh& mesh,
                      const TransferData& data, std::span<const Light> lights) {
  const std::vector<std::byte> bytes = encode_glb(mesh, data, lights);
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
  return bytes.size();
}

}  // namespace rebounce
