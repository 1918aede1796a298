#include "precompute/import/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "precompute/import/gltf_images.h"
#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

constexpr auto kNegativeFactors = "{} material colours were negative and were set to 0";
// Of textures that have nothing but a KTX2 image. Without the picture that says which parts shine,
// all of a surface would.
constexpr auto kUnreadColor =
    "{} materials have colours in KTX2 images (KHR_texture_basisu), which are not read: their "
    "factor alone is taken; for their colours export PNG, JPEG or WebP";
constexpr auto kUnreadEmission =
    "{} materials have emission in KTX2 images (KHR_texture_basisu), which are not read: they emit "
    "nothing; for their light export PNG, JPEG or WebP";
constexpr auto kUnreadTransmission =
    "{} materials have transmission in KTX2 images (KHR_texture_basisu), which are not read: their "
    "factor alone is taken";

// Emission above this, cd/m², is refused: sums of light over surfaces must stay finite. The sun has
// 2e9.
constexpr float kBrightestEmission = 1e30F;

// The parts of a textureInfo object that the importer uses, from any of its places.
struct TextureReference {
  int texture = -1;
  TexcoordSource texcoord;
};

Float2 pair_or(const tinygltf::Value& object, const char* key, Float2 fallback) {
  if (!object.Has(key)) return fallback;
  const auto& values = object.Get(key);
  return {static_cast<float>(values.Get(0).GetNumberAsDouble()),
          static_cast<float>(values.Get(1).GetNumberAsDouble())};
}

void apply_transform(const tinygltf::Value& transform, TexcoordSource& texcoord) {
  texcoord.offset = pair_or(transform, "offset", texcoord.offset);
  texcoord.scale = pair_or(transform, "scale", texcoord.scale);
  if (transform.Has("rotation")) texcoord.rotation = transform.Get("rotation").GetNumberAsDouble();
  if (transform.Has("texCoord")) texcoord.set = transform.Get("texCoord").GetNumberAsInt();
}

TextureReference reference(const tinygltf::TextureInfo& info) {
  TextureReference result{info.index, {}};
  result.texcoord.set = info.texCoord;
  const auto transform = info.extensions.find("KHR_texture_transform");
  if (transform != info.extensions.end()) apply_transform(transform->second, result.texcoord);
  return result;
}

// The same from an object inside an extension, which tinygltf leaves unparsed.
TextureReference reference(const tinygltf::Value& info) {
  TextureReference result{info.Get("index").GetNumberAsInt(), {}};
  if (info.Has("texCoord")) result.texcoord.set = info.Get("texCoord").GetNumberAsInt();
  if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
    apply_transform(info.Get("extensions").Get("KHR_texture_transform"), result.texcoord);
  }
  return result;
}

TextureWrap to_wrap(int code) {
  switch (code) {
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return TextureWrap::kClampToEdge;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return TextureWrap::kMirroredRepeat;
    default:
      return TextureWrap::kRepeat;
  }
}

// The images of the asset that a texture can use, the preferred one first.
std::vector<int> sources_of(const tinygltf::Texture& texture) {
  std::vector<int> sources;
  const auto webp = texture.extensions.find("EXT_texture_webp");
  if (webp != texture.extensions.end() && webp->second.Has("source")) {
    sources.push_back(webp->second.Get("source").GetNumberAsInt());
  }
  if (texture.source >= 0) sources.push_back(texture.source);
  return sources;
}

// Adds textures to the scene at their first use. The same image with the same wrapping is one
// texture.
class TextureImport {
 public:
  TextureImport(const Document& document, Scene& scene, Warnings& warnings)
      : document_(document), scene_(scene), warnings_(warnings) {}

  // The texture of the scene for that of the asset, or kNone (white) if it has no image.
  std::uint32_t operator()(int index) {
    const auto& texture = document_.model.textures.at(static_cast<std::size_t>(index));
    const std::vector<int> sources = sources_of(texture);
    if (sources.empty()) {
      warnings_.add(
          fmt::format("textures[{}] has no PNG, JPEG or WebP image; white instead", index));
    }
    TextureWrap wrap_s = TextureWrap::kRepeat;
    TextureWrap wrap_t = TextureWrap::kRepeat;
    if (texture.sampler >= 0) {
      const auto& sampler = document_.model.samplers.at(static_cast<std::size_t>(texture.sampler));
      wrap_s = to_wrap(sampler.wrapS);
      wrap_t = to_wrap(sampler.wrapT);
    }
    for (const int source : sources) {
      const auto [known, is_new] = known_.try_emplace({source, wrap_s, wrap_t}, kNone);
      if (is_new) known->second = add(source, wrap_s, wrap_t, source == sources.back());
      if (known->second != kNone) return known->second;
    }
    return kNone;
  }

  // Whether a texture of the asset has nothing but a KTX2 image.
  bool is_basis_universal(int index) const {
    if (index < 0) return false;
    const auto& texture = document_.model.textures.at(static_cast<std::size_t>(index));
    return texture.extensions.contains("KHR_texture_basisu") && sources_of(texture).empty();
  }

  // The mean of the red channel of a texture of the asset, a fraction; empty if no image of it can
  // be read.
  std::optional<double> mean_red(int index) const {
    const auto& texture = document_.model.textures.at(static_cast<std::size_t>(index));
    for (const int source : sources_of(texture)) {
      const auto image = decode(document_.images.at(static_cast<std::size_t>(source)), source);
      if (!image) continue;
      const std::vector<std::uint8_t>& rgba = image->image.rgba;
      const std::size_t pixel_count = rgba.size() / 4;
      double sum = 0;
      for (std::size_t k = 0; k < pixel_count; ++k) sum += rgba[4 * k];
      return sum / (255.0 * static_cast<double>(pixel_count));
    }
    return {};
  }

 private:
  std::uint32_t add(int source, TextureWrap wrap_s, TextureWrap wrap_t, bool is_last) {
    const EncodedImage& encoded = document_.images.at(static_cast<std::size_t>(source));
    std::optional<DecodedImage> image = decode(encoded, source);
    if (!image) {
      const std::string problem =
          encoded.problem.empty() ? "it cannot be decoded as PNG, JPEG or WebP" : encoded.problem;
      warnings_.add(fmt::format("images[{}] is not used, {} instead: {}", source,
                                is_last ? "white" : "its fallback", problem));
      return kNone;
    }
    scene_.textures.push_back({std::move(image->stored), wrap_s, wrap_t});
    scene_.images.push_back(std::move(image->image));
    return static_cast<std::uint32_t>(scene_.textures.size() - 1);
  }

  static std::optional<DecodedImage> decode(const EncodedImage& encoded, int source) {
    try {
      return decode_image(encoded.bytes);
    } catch (const Error& failure) {
      throw Error(fmt::format("images[{}]: {}", source, failure.what()));
    }
  }

  const Document& document_;
  Scene& scene_;
  Warnings& warnings_;
  std::map<std::tuple<int, TextureWrap, TextureWrap>, std::uint32_t> known_;
};

Float3 to_color(const std::vector<double>& factor, Warnings& warnings) {
  Float3 color{};
  for (std::size_t channel = 0; channel < color.size(); ++channel) {
    color[channel] = static_cast<float>(factor[channel]);
    if (!std::isfinite(color[channel])) throw Error("a colour factor is not a finite number");
    if (color[channel] >= 0) continue;
    color[channel] = 0;
    warnings.count(kNegativeFactors);
  }
  return color;
}

struct BaseColor {
  Float3 factor{1, 1, 1};
  float alpha = 1;
  TextureReference texture;
};

// Clamps a number to [0, 1].
float to_fraction(double value) {
  if (!std::isfinite(value)) throw Error("a factor is not a finite number");
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

BaseColor base_color(const tinygltf::Material& source, Warnings& warnings) {
  const auto gloss = source.extensions.find("KHR_materials_pbrSpecularGlossiness");
  if (gloss == source.extensions.end()) {
    const auto& surface = source.pbrMetallicRoughness;
    return {to_color(surface.baseColorFactor, warnings), to_fraction(surface.baseColorFactor[3]),
            reference(surface.baseColorTexture)};
  }
  BaseColor color;
  if (gloss->second.Has("diffuseFactor")) {
    std::vector<double> factor;
    for (int channel = 0; channel < 4; ++channel) {
      factor.push_back(gloss->second.Get("diffuseFactor").Get(channel).GetNumberAsDouble());
    }
    color.factor = to_color(factor, warnings);
    color.alpha = to_fraction(factor[3]);
  }
  if (gloss->second.Has("diffuseTexture")) {
    color.texture = reference(gloss->second.Get("diffuseTexture"));
  }
  return color;
}

AlphaMode alpha_mode(const tinygltf::Material& source) {
  if (source.alphaMode == "MASK") return AlphaMode::kMask;
  if (source.alphaMode == "BLEND") return AlphaMode::kBlend;
  return AlphaMode::kOpaque;
}

float alpha_cutoff(const tinygltf::Material& source) {
  const auto cutoff = static_cast<float>(source.alphaCutoff);
  if (!std::isfinite(cutoff)) throw Error("alphaCutoff is not a finite number");
  return std::max(cutoff, 0.0F);
}

struct Transmission {
  double factor = 0;
  int texture = -1;
};

Transmission transmission(const tinygltf::Material& source) {
  const auto glass = source.extensions.find("KHR_materials_transmission");
  if (glass == source.extensions.end() || !glass->second.Has("transmissionFactor")) return {};
  Transmission result{glass->second.Get("transmissionFactor").GetNumberAsDouble()};
  if (glass->second.Has("transmissionTexture")) {
    result.texture = glass->second.Get("transmissionTexture").Get("index").GetNumberAsInt();
  }
  return result;
}

Float3 emitted_luminance(const tinygltf::Material& source, Warnings& warnings) {
  std::vector<double> factor = source.emissiveFactor;
  const auto extension = source.extensions.find("KHR_materials_emissive_strength");
  if (extension != source.extensions.end() && extension->second.Has("emissiveStrength")) {
    const double strength = extension->second.Get("emissiveStrength").GetNumberAsDouble();
    for (double& channel : factor) channel *= strength;
  }
  const Float3 luminance = to_color(factor, warnings);
  if (std::ranges::any_of(luminance, [](float x) { return x > kBrightestEmission; })) {
    throw Error("it emits more than 1e30 cd/m²; lower its emissiveStrength");
  }
  return luminance;
}

bool is_black(const Float3& color) {
  return color == Float3{0, 0, 0};
}

class MaterialImport {
 public:
  MaterialImport(const Document& document, Scene& scene, Warnings& warnings)
      : textures_(document, scene, warnings), warnings_(warnings) {}

  Material operator()(const tinygltf::Material& source, MaterialTexcoords& texcoords) {
    Material material;
    material.name = source.name;
    material.double_sided = source.doubleSided;
    const BaseColor color = base_color(source, warnings_);
    material.base_color = color.factor;
    if (!is_unread(color.texture.texture, kUnreadColor)) {
      material.base_color_texture = resolve(color.texture, texcoords.base_color);
    }
    material.alpha_mode = alpha_mode(source);
    material.alpha_cutoff = alpha_cutoff(source);
    material.base_alpha = color.alpha;
    read_transmission(source, material);
    texcoords.uses_alpha = material.alpha_mode != AlphaMode::kOpaque;
    read_emission(source, material, texcoords.emissive);
    warn_of_what_is_simplified(source, material);
    return material;
  }

 private:
  // Whether nothing of a texture is read; `warning` counts the materials of which that is so.
  bool is_unread(int texture, const char* warning) {
    if (!textures_.is_basis_universal(texture)) return false;
    warnings_.count(warning);
    return true;
  }

  std::uint32_t resolve(const TextureReference& reference, TexcoordSource& texcoord) {
    if (reference.texture < 0) return kNone;
    const std::uint32_t texture = textures_(reference.texture);
    texcoord = reference.texcoord;
    texcoord.used = texture != kNone;
    return texture;
  }

  void read_transmission(const tinygltf::Material& source, Material& material) {
    const auto [factor, texture] = transmission(source);
    material.transmission = to_fraction(factor);
    if (material.transmission == 0 || texture < 0) return;
    if (is_unread(texture, kUnreadTransmission)) return;
    if (const std::optional<double> mean = textures_.mean_red(texture)) {
      material.transmission *= static_cast<float>(*mean);
      warnings_.count("the transmission textures of {} materials are taken for their mean");
    } else {
      warnings_.count(
          "{} materials have transmission textures that cannot be read: their factor alone is "
          "taken");
    }
  }

  void read_emission(const tinygltf::Material& source, Material& material,
                     TexcoordSource& texcoord) {
    const Float3 luminance = emitted_luminance(source, warnings_);
    if (is_black(luminance)) return;
    if (source.extensions.contains("KHR_materials_unlit")) {
      warnings_.count("the emission of {} unlit materials is dropped, as the extension says");
      return;
    }
    const TextureReference texture = reference(source.emissiveTexture);
    if (is_unread(texture.texture, kUnreadEmission)) return;
    material.emitted_luminance = luminance;
    material.emissive_texture = resolve(texture, texcoord);
  }

  void warn_of_what_is_simplified(const tinygltf::Material& source, const Material& material) {
    if (source.extensions.contains("KHR_materials_unlit")) {
      warnings_.count("{} unlit materials are lit like all others");
    }
    if (material.transmission > 0 && !is_black(material.emitted_luminance)) {
      warnings_.count("{} materials that emit and transmit light are taken to transmit none");
    }
    if (source.extensions.contains("KHR_materials_diffuse_transmission")) {
      warnings_.count("{} materials that transmit light diffusely are taken as opaque");
    }
  }

  TextureImport textures_;
  Warnings& warnings_;
};

}  // namespace

Float2 TexcoordSource::transformed(Float2 texcoord) const {
  // Translation x rotation x scale, counter-clockwise in a space whose v axis points down.
  const double u = static_cast<double>(scale[0]) * texcoord[0];
  const double v = static_cast<double>(scale[1]) * texcoord[1];
  const double cosine = std::cos(rotation);
  const double sine = std::sin(rotation);
  return {static_cast<float>(cosine * u + sine * v + offset[0]),
          static_cast<float>(cosine * v - sine * u + offset[1])};
}

std::vector<MaterialTexcoords> import_materials(const Document& document, Scene& scene,
                                                Warnings& warnings) {
  const auto& sources = document.model.materials;
  std::vector<MaterialTexcoords> texcoords(sources.size() + 1);
  MaterialImport import_material(document, scene, warnings);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    try {
      scene.materials.push_back(import_material(sources[i], texcoords[i]));
    } catch (const Error& failure) {
      throw Error(fmt::format("materials[{}] \"{}\": {}", i, sources[i].name, failure.what()));
    }
  }
  scene.materials.push_back({});
  scene.materials.back().name = "default";
  return texcoords;
}

}  // namespace rebounce::gltf
