#include "precompute/import/gltf_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

using nlohmann::json;

constexpr std::array kSupportedExtensions{
    std::string_view{"KHR_lights_punctual"},
    std::string_view{"KHR_mesh_quantization"},
    std::string_view{"KHR_draco_mesh_compression"},
    std::string_view{"KHR_meshopt_compression"},
    std::string_view{"EXT_meshopt_compression"},
    std::string_view{"EXT_mesh_gpu_instancing"},
    std::string_view{"EXT_texture_webp"},
    std::string_view{"KHR_texture_basisu"},  // not read: what is left out is a warning
    std::string_view{"KHR_texture_transform"},
    std::string_view{"KHR_materials_emissive_strength"},
    std::string_view{"KHR_materials_pbrSpecularGlossiness"},
    std::string_view{"KHR_materials_unlit"},
    // These change how light is reflected or transmitted, not how much of it a diffuse surface of
    // the same base colour returns: they are ignored.
    std::string_view{"KHR_materials_anisotropy"},
    std::string_view{"KHR_materials_clearcoat"},
    std::string_view{"KHR_materials_diffuse_transmission"},
    std::string_view{"KHR_materials_dispersion"},
    std::string_view{"KHR_materials_ior"},
    std::string_view{"KHR_materials_iridescence"},
    std::string_view{"KHR_materials_sheen"},
    std::string_view{"KHR_materials_specular"},
    std::string_view{"KHR_materials_transmission"},
    std::string_view{"KHR_materials_variants"},
    std::string_view{"KHR_materials_volume"},
};

struct Version {
  int major = 0;
  int minor = 0;
};

Version parse_version(const json& asset, const char* key) {
  const auto& value = asset.at(key);
  Version version;
  if (value.is_string()) {
    const std::string& text = value.get_ref<const std::string&>();
    const char* const end = text.data() + text.size();
    const auto major = std::from_chars(text.data(), end, version.major);
    if (major.ec == std::errc{} && major.ptr != end && *major.ptr == '.') {
      const auto minor = std::from_chars(major.ptr + 1, end, version.minor);
      if (minor.ec == std::errc{} && minor.ptr == end) return version;
    }
  }
  throw Error(fmt::format("asset.{} is not a version number like \"2.0\"", key));
}

void check_version(const json& root) {
  if (!root.contains("asset") || !root["asset"].is_object() || !root["asset"].contains("version")) {
    throw Error("this is not glTF: it states no asset.version");
  }
  const json& asset = root["asset"];
  if (const Version version = parse_version(asset, "version"); version.major != 2) {
    throw Error(fmt::format("glTF {}.{} is not supported; convert the asset to glTF 2.0",
                            version.major, version.minor));
  }
  if (!asset.contains("minVersion")) return;
  if (const Version version = parse_version(asset, "minVersion");
      version.major != 2 || version.minor > 0) {
    throw Error(fmt::format("the asset needs a reader of glTF {}.{}; this one reads 2.0",
                            version.major, version.minor));
  }
}

// Walks the JSON and tracks the name of each place, for messages like "accessors[3].bufferView is
// 7, but there are 2 bufferViews".
class StructureCheck {
 public:
  explicit StructureCheck(json& root) : root_(root) {}

  void run() {
    for_each(root_, "buffers", "", [&](json& buffer, const std::string& at) {
      size(buffer, "byteLength", at, kRequired);
      text(buffer, "uri", at);
    });
    for_each(root_, "bufferViews", "", [&](json& view, const std::string& at) {
      index(view, "buffer", "buffers", at, kRequired);
      size(view, "byteOffset", at);
      size(view, "byteLength", at, kRequired);
      size(view, "byteStride", at);
      for (const char* name : {"KHR_meshopt_compression", "EXT_meshopt_compression"}) {
        if (json* compressed = extension(view, name)) compressed_view(*compressed, at, name);
      }
    });
    for_each(root_, "accessors", "",
             [&](json& item, const std::string& at) { accessor(item, at); });
    for_each(root_, "meshes", "", [&](json& mesh, const std::string& at) {
      for_each(mesh, "primitives", at,
               [&](json& item, const std::string& place) { primitive(item, place); });
    });
    for_each(root_, "nodes", "", [&](json& item, const std::string& at) { node(item, at); });
    for_each(root_, "scenes", "",
             [&](json& scene, const std::string& at) { indices(scene, "nodes", "nodes", at); });
    index(root_, "scene", "scenes", "");
    images_and_textures();
    for_each(root_, "materials", "",
             [&](json& item, const std::string& at) { material(item, at); });
    for_each(root_, "cameras", "", [&](json& camera, const std::string& at) {
      text(camera, "type", at, kRequired);
      if (json* lens = object(camera, "perspective", at)) real(*lens, "yfov", at + ".perspective");
    });
    lights();
  }

 private:
  static constexpr bool kRequired = true;

  static std::string join(const std::string& at, const char* key) {
    return at.empty() ? key : at + "." + key;
  }

  // The member `key`, or null if it is missing (Error if it is required).
  static json* member(json& parent, const char* key, const std::string& at, bool required = false) {
    const auto found = parent.find(key);
    if (found != parent.end()) return &*found;
    if (required) throw Error(fmt::format("{} is missing", join(at, key)));
    return nullptr;
  }

  static json* object(json& parent, const char* key, const std::string& at, bool required = false) {
    json* value = member(parent, key, at, required);
    if (value && !value->is_object()) throw Error(join(at, key) + " is not an object");
    return value;
  }

  static json* array(json& parent, const char* key, const std::string& at) {
    json* value = member(parent, key, at);
    if (value && !value->is_array()) throw Error(join(at, key) + " is not an array");
    return value;
  }

  // The extension `name` of `parent`, or null. Like tinygltf, ignores values that are no objects.
  static json* extension(json& parent, const char* name) {
    const auto extensions = parent.find("extensions");
    if (extensions == parent.end() || !extensions->is_object()) return nullptr;
    const auto found = extensions->find(name);
    return found != extensions->end() && found->is_object() ? &*found : nullptr;
  }

  template <typename Visit>
  static void for_each(json& parent, const char* key, const std::string& at, const Visit& visit) {
    json* values = array(parent, key, at);
    if (!values) return;
    for (std::size_t i = 0; i < values->size(); ++i) {
      const std::string place = fmt::format("{}[{}]", join(at, key), i);
      if (!(*values)[i].is_object()) throw Error(place + " is not an object");
      visit((*values)[i], place);
    }
  }

  // Converts `value` to an integer in [0, 2^53], or throws Error.
  static std::uint64_t whole_number(json& value, const std::string& place) {
    constexpr double kExactIntegers = 9007199254740992.0;
    if (value.is_number()) {
      const double number = value.get<double>();
      if (number >= 0 && number <= kExactIntegers && number == std::floor(number)) {
        value = static_cast<std::uint64_t>(number);
        return value.get<std::uint64_t>();
      }
    }
    throw Error(fmt::format("{} is {}, not a whole number of at least 0", place, shown(value)));
  }

  static std::string shown(const json& value) {
    return value.is_number() ? value.dump() : std::string(value.type_name());
  }

  // Checks sizes and codes. tinygltf stores some of them as int, and no real asset has larger ones.
  static void check_size(json& value, const std::string& place) {
    if (whole_number(value, place) <= std::numeric_limits<int>::max()) return;
    throw Error(fmt::format("{} is {}, above the limit of 2147483647", place, value.dump()));
  }

  static void size(json& parent, const char* key, const std::string& at, bool required = false) {
    if (json* value = member(parent, key, at, required)) check_size(*value, join(at, key));
  }

  void check_index(json& value, const char* target, const std::string& place) {
    const std::size_t count = root_.contains(target) ? root_[target].size() : 0;
    check_index(value, count, target, place);
  }

  static void check_index(json& value, std::size_t count, const char* target,
                          const std::string& place) {
    if (whole_number(value, place) < count) return;
    throw Error(fmt::format("{} is {}, but there are {} {}", place, value.dump(), count, target));
  }

  void index(json& parent, const char* key, const char* target, const std::string& at,
             bool required = false) {
    if (json* value = member(parent, key, at, required)) check_index(*value, target, join(at, key));
  }

  void indices(json& parent, const char* key, const char* target, const std::string& at) {
    json* values = array(parent, key, at);
    if (!values) return;
    for (std::size_t i = 0; i < values->size(); ++i) {
      check_index((*values)[i], target, fmt::format("{}[{}]", join(at, key), i));
    }
  }

  static void real(json& value, const std::string& place) {
    if (!value.is_number()) throw Error(place + " is not a number");
    value = value.get<double>();
  }

  static void real(json& parent, const char* key, const std::string& at) {
    if (json* value = member(parent, key, at)) real(*value, join(at, key));
  }

  static void reals(json& parent, const char* key, std::size_t count, const std::string& at) {
    json* values = array(parent, key, at);
    if (!values) return;
    if (values->size() != count) {
      throw Error(
          fmt::format("{} has {} numbers instead of {}", join(at, key), values->size(), count));
    }
    for (json& value : *values) real(value, join(at, key));
  }

  static void text(json& parent, const char* key, const std::string& at, bool required = false) {
    json* value = member(parent, key, at, required);
    if (value && !value->is_string()) throw Error(join(at, key) + " is not a string");
  }

  void accessor(json& item, const std::string& at) {
    index(item, "bufferView", "bufferViews", at);
    size(item, "byteOffset", at);
    size(item, "componentType", at, kRequired);
    size(item, "count", at, kRequired);
    text(item, "type", at, kRequired);
    json* sparse = object(item, "sparse", at);
    if (!sparse) return;
    const std::string place = at + ".sparse";
    size(*sparse, "count", place, kRequired);
    json* replaced = object(*sparse, "indices", place, kRequired);
    index(*replaced, "bufferView", "bufferViews", place + ".indices", kRequired);
    size(*replaced, "byteOffset", place + ".indices");
    size(*replaced, "componentType", place + ".indices", kRequired);
    json* values = object(*sparse, "values", place, kRequired);
    index(*values, "bufferView", "bufferViews", place + ".values", kRequired);
    size(*values, "byteOffset", place + ".values");
  }

  void primitive(json& item, const std::string& at) {
    index(item, "indices", "accessors", at);
    index(item, "material", "materials", at);
    size(item, "mode", at);
    json* attributes = object(item, "attributes", at, kRequired);
    for (auto& [name, value] : attributes->items()) {
      check_index(value, "accessors", at + ".attributes." + name);
    }
    if (json* draco = extension(item, "KHR_draco_mesh_compression")) {
      const std::string place = at + ".extensions.KHR_draco_mesh_compression";
      index(*draco, "bufferView", "bufferViews", place, kRequired);
      for (auto& [name, value] : object(*draco, "attributes", place, kRequired)->items()) {
        check_size(value, place + ".attributes." + name);
      }
    }
  }

  void compressed_view(json& compressed, const std::string& at, const char* name) {
    const std::string place = fmt::format("{}.extensions.{}", at, name);
    index(compressed, "buffer", "buffers", place, kRequired);
    size(compressed, "byteOffset", place);
    for (const char* key : {"byteLength", "byteStride", "count"}) {
      size(compressed, key, place, kRequired);
    }
    text(compressed, "mode", place, kRequired);
    text(compressed, "filter", place);
  }

  void node(json& item, const std::string& at) {
    index(item, "mesh", "meshes", at);
    index(item, "camera", "cameras", at);
    indices(item, "children", "nodes", at);
    reals(item, "matrix", 16, at);
    reals(item, "translation", 3, at);
    reals(item, "rotation", 4, at);
    reals(item, "scale", 3, at);
    if (json* light = extension(item, "KHR_lights_punctual")) {
      const std::string place = at + ".extensions.KHR_lights_punctual";
      json* value = member(*light, "light", place, kRequired);
      check_index(*value, light_count(), "lights", place + ".light");
    }
    if (json* instancing = extension(item, "EXT_mesh_gpu_instancing")) {
      const std::string place = at + ".extensions.EXT_mesh_gpu_instancing";
      for (auto& [name, value] : object(*instancing, "attributes", place, kRequired)->items()) {
        check_index(value, "accessors", place + ".attributes." + name);
      }
    }
  }

  void images_and_textures() {
    for_each(root_, "images", "", [&](json& image, const std::string& at) {
      text(image, "uri", at);
      index(image, "bufferView", "bufferViews", at);
    });
    for_each(root_, "textures", "", [&](json& texture, const std::string& at) {
      index(texture, "source", "images", at);
      index(texture, "sampler", "samplers", at);
      if (json* webp = extension(texture, "EXT_texture_webp")) {
        index(*webp, "source", "images", at + ".extensions.EXT_texture_webp", kRequired);
      }
    });
    for_each(root_, "samplers", "", [&](json& sampler, const std::string& at) {
      size(sampler, "wrapS", at);
      size(sampler, "wrapT", at);
    });
  }

  void texture_info(json& parent, const char* key, const std::string& at) {
    json* info = object(parent, key, at);
    if (!info) return;
    const std::string place = join(at, key);
    index(*info, "index", "textures", place, kRequired);
    size(*info, "texCoord", place);
    if (json* transform = extension(*info, "KHR_texture_transform")) {
      const std::string inside = place + ".extensions.KHR_texture_transform";
      reals(*transform, "offset", 2, inside);
      reals(*transform, "scale", 2, inside);
      real(*transform, "rotation", inside);
      size(*transform, "texCoord", inside);
    }
  }

  void material(json& item, const std::string& at) {
    if (json* surface = object(item, "pbrMetallicRoughness", at)) {
      reals(*surface, "baseColorFactor", 4, at + ".pbrMetallicRoughness");
      texture_info(*surface, "baseColorTexture", at + ".pbrMetallicRoughness");
    }
    text(item, "alphaMode", at);
    real(item, "alphaCutoff", at);
    reals(item, "emissiveFactor", 3, at);
    texture_info(item, "emissiveTexture", at);
    if (json* strength = extension(item, "KHR_materials_emissive_strength")) {
      real(*strength, "emissiveStrength", at + ".extensions.KHR_materials_emissive_strength");
    }
    if (json* glass = extension(item, "KHR_materials_transmission")) {
      const std::string place = at + ".extensions.KHR_materials_transmission";
      real(*glass, "transmissionFactor", place);
      texture_info(*glass, "transmissionTexture", place);
    }
    if (json* gloss = extension(item, "KHR_materials_pbrSpecularGlossiness")) {
      const std::string place = at + ".extensions.KHR_materials_pbrSpecularGlossiness";
      reals(*gloss, "diffuseFactor", 4, place);
      texture_info(*gloss, "diffuseTexture", place);
    }
  }

  std::size_t light_count() {
    json* punctual = extension(root_, "KHR_lights_punctual");
    return punctual && punctual->contains("lights") ? (*punctual)["lights"].size() : 0;
  }

  void lights() {
    json* punctual = extension(root_, "KHR_lights_punctual");
    if (!punctual) return;
    for_each(*punctual, "lights", "extensions.KHR_lights_punctual",
             [&](json& light, const std::string& at) {
               text(light, "type", at, kRequired);
               reals(light, "color", 3, at);
               real(light, "intensity", at);
               real(light, "range", at);
               if (json* spot = object(light, "spot", at)) {
                 real(*spot, "innerConeAngle", at + ".spot");
                 real(*spot, "outerConeAngle", at + ".spot");
               }
             });
  }

  json& root_;
};

}  // namespace

void check_version_and_extensions(const json& root) {
  check_version(root);
  const auto required = root.find("extensionsRequired");
  if (required == root.end()) return;
  if (!required->is_array()) throw Error("extensionsRequired is not an array");
  for (const json& name : *required) {
    if (!name.is_string()) throw Error("extensionsRequired holds something that is not a name");
    const auto& text = name.get_ref<const std::string&>();
    if (std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), text) ==
        kSupportedExtensions.end()) {
      throw Error(fmt::format(
          "the asset requires {}, which is not supported; export it without that extension", text));
    }
  }
}

void check_structure(json& root) {
  StructureCheck(root).run();
}

}  // namespace rebounce::gltf
