#include "precompute/import/gltf_primitives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "precompute/import/gltf_accessors.h"
#include "precompute/import/gltf_draco.h"
#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

template <std::size_t N>
bool is_finite(const std::array<float, N>& v) {
  return std::all_of(v.begin(), v.end(), [](float value) { return std::isfinite(value); });
}

bool draws_triangles(int mode) {
  return mode == TINYGLTF_MODE_TRIANGLES || mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
         mode == TINYGLTF_MODE_TRIANGLE_FAN;
}

// Corners of triangle `t` in the sequence of vertices, glTF 2.0 section 3.7.2.1.
Uint3 corners(int mode, std::uint32_t t) {
  switch (mode) {
    case TINYGLTF_MODE_TRIANGLE_STRIP:
      return {t, t + 1 + t % 2, t + 2 - t % 2};
    case TINYGLTF_MODE_TRIANGLE_FAN:
      return {t + 1, t + 2, 0};
    default:
      return {3 * t, 3 * t + 1, 3 * t + 2};
  }
}

std::vector<Uint3> assemble_triangles(int mode, std::span<const std::uint32_t> index) {
  const std::size_t count = mode == TINYGLTF_MODE_TRIANGLES ? index.size() / 3
                            : index.size() < 3              ? 0
                                                            : index.size() - 2;
  std::vector<Uint3> triangles(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Uint3 corner = corners(mode, static_cast<std::uint32_t>(t));
    triangles[t] = {index[corner[0]], index[corner[1]], index[corner[2]]};
  }
  return triangles;
}

class PrimitiveReader {
 public:
  // `compressed` is null if the primitive has no Draco data.
  PrimitiveReader(const Document& document, const tinygltf::Primitive& source,
                  const DracoSource* compressed, Warnings& warnings)
      : document_(document), source_(source), compressed_(compressed), warnings_(warnings) {}

  void read(const MaterialTexcoords& texcoords, Primitive& primitive) {
    if (!compressed_) return read_geometry(texcoords, primitive);
    try {
      decode_draco();
      read_geometry(texcoords, primitive);
    } catch (const Error&) {
      if (!compressed_->has_fallback) throw;
      warnings_.count("{} Draco primitives cannot be decoded; their fallback is used");
      draco_.reset();
      read_geometry(texcoords, primitive);
    }
  }

 private:
  void decode_draco() {
    if (source_.mode != TINYGLTF_MODE_TRIANGLES) {
      throw Error("only triangle lists are read from Draco data; export it as one");
    }
    const std::size_t expected = compressed_->index_count.value_or(3 * kMaxTriangles) / 3;
    draco_ = std::make_unique<DracoMesh>(view_bytes(document_, compressed_->buffer_view),
                                         std::min(expected, kMaxTriangles));
  }

  const tinygltf::Accessor& accessor_of(int index) const {
    return document_.model.accessors.at(static_cast<std::size_t>(index));
  }

  void read_geometry(const MaterialTexcoords& texcoords, Primitive& primitive) {
    read_positions(primitive);
    read_triangles(primitive);
    if (const int accessor = attribute("NORMAL"); accessor >= 0) {
      primitive.normal = vectors<3>(read(accessor, "NORMAL", {3}));
    }
    primitive.base_color_texcoord = read_texcoords(texcoords.base_color);
    primitive.emissive_texcoord = read_texcoords(texcoords.emissive);
    read_lightmap_texcoords(primitive);
    read_colors(texcoords.uses_alpha, primitive);
  }

  int attribute(const std::string& name) const {
    const auto found = source_.attributes.find(name);
    return found == source_.attributes.end() ? -1 : found->second;
  }

  // Reads an attribute with one of the allowed numbers of components and one element for each
  // vertex.
  FloatElements read(int accessor, const std::string& name,
                     std::initializer_list<std::size_t> allowed_components) const {
    FloatElements elements = read_elements(accessor, name);
    if (std::find(allowed_components.begin(), allowed_components.end(), elements.component_count) ==
        allowed_components.end()) {
      throw Error(fmt::format("{} (accessors[{}]) has {} components", name, accessor,
                              elements.component_count));
    }
    if (name != "POSITION" && elements.count != vertex_count_) {
      throw Error(fmt::format("{} (accessors[{}]) has {} elements, but POSITION has {}", name,
                              accessor, elements.count, vertex_count_));
    }
    return elements;
  }

  FloatElements read_elements(int accessor, const std::string& name) const {
    if (!draco_ || !compressed_->unique_id.contains(name)) return read_floats(document_, accessor);
    try {
      return draco_->read_floats(compressed_->unique_id.at(name), accessor_of(accessor));
    } catch (const Error& failure) {
      throw Error(fmt::format("{} (accessors[{}]): {}", name, accessor, failure.what()));
    }
  }

  template <std::size_t N>
  static std::vector<std::array<float, N>> vectors(const FloatElements& elements) {
    std::vector<std::array<float, N>> result(elements.count);
    for (std::size_t i = 0; i < result.size(); ++i) {
      for (std::size_t component = 0; component < N; ++component) {
        result[i][component] = elements.at(i, component);
      }
    }
    return result;
  }

  void read_positions(Primitive& primitive) {
    const int accessor = attribute("POSITION");
    const FloatElements elements = read(accessor, "POSITION", {3});
    vertex_count_ = elements.count;
    primitive.position = vectors<3>(elements);
    const auto bad =
        std::find_if_not(primitive.position.begin(), primitive.position.end(), is_finite<3>);
    if (bad != primitive.position.end()) {
      throw Error(fmt::format("the position of vertex {} is not finite; repair the mesh",
                              bad - primitive.position.begin()));
    }
  }

  std::vector<std::uint32_t> indices() const {
    if (draco_) return draco_indices();
    if (source_.indices >= 0) return read_indices(document_, source_.indices);
    std::vector<std::uint32_t> index(vertex_count_);
    std::iota(index.begin(), index.end(), 0U);
    return index;
  }

  std::vector<std::uint32_t> draco_indices() const {
    auto index = draco_->indices();
    if (index.size() != compressed_->index_count.value_or(index.size())) {
      throw Error(fmt::format("its Draco data have {} indices, but the accessor {} elements",
                              index.size(), *compressed_->index_count));
    }
    return index;
  }

  void read_triangles(Primitive& primitive) {
    const std::vector<std::uint32_t> index = indices();
    const auto bad = std::find_if(index.begin(), index.end(),
                                  [&](std::uint32_t vertex) { return vertex >= vertex_count_; });
    if (bad != index.end()) {
      throw Error(fmt::format("index {} is {}, but there are {} vertices; repair the mesh",
                              bad - index.begin(), *bad, vertex_count_));
    }
    if (source_.mode == TINYGLTF_MODE_TRIANGLES && index.size() % 3 != 0) {
      warnings_.count("{} triangle lists do not end with a whole triangle; the rest is ignored");
    }
    primitive.triangle = assemble_triangles(source_.mode, index);
  }

  std::vector<Float2> read_texcoords(const TexcoordSource& source) {
    const std::string name = fmt::format("TEXCOORD_{}", source.set);
    const int accessor = source.used ? attribute(name) : -1;
    if (accessor < 0) {
      if (source.used) warnings_.count("{} textured primitives lack their texture coordinates");
      return std::vector<Float2>(vertex_count_, Float2{0, 0});
    }
    auto texcoords = vectors<2>(read(accessor, name, {2}));
    for (Float2& texcoord : texcoords) {
      texcoord = source.transformed(texcoord);
      if (is_finite(texcoord)) continue;
      texcoord = {0, 0};
      warnings_.count("{} texture coordinates were not finite and were set to 0");
    }
    return texcoords;
  }

  // Reads TEXCOORD_1 without a transform: programs that unwrap for lightmaps write it.
  void read_lightmap_texcoords(Primitive& primitive) {
    const int accessor = attribute("TEXCOORD_1");
    if (accessor < 0) return;
    primitive.lightmap_texcoord = vectors<2>(read(accessor, "TEXCOORD_1", {2}));
    if (std::ranges::all_of(primitive.lightmap_texcoord, is_finite<2>)) return;
    primitive.lightmap_texcoord.clear();
    warnings_.count("the second texture coordinates of {} primitives are not finite: ignored");
  }

  void read_colors(bool uses_alpha, Primitive& primitive) {
    const int accessor = attribute("COLOR_0");
    if (accessor < 0) {
      primitive.vertex_color.assign(vertex_count_, Float3{1, 1, 1});
      return;
    }
    const FloatElements elements = read(accessor, "COLOR_0", {3, 4});
    if (elements.was_integer) {
      throw Error(fmt::format("COLOR_0 (accessors[{}]) is not normalized", accessor));
    }
    if (uses_alpha && elements.component_count == 4 && has_alpha(elements)) {
      warnings_.count("the alpha of the vertex colours of {} primitives is ignored");
    }
    primitive.vertex_color = vectors<3>(elements);
    for (Float3& color : primitive.vertex_color) {
      for (float& channel : color) {
        if (channel >= 0 && std::isfinite(channel)) continue;
        channel = 0;
        warnings_.count("{} vertex colour values were negative or not finite and were set to 0");
      }
    }
  }

  static bool has_alpha(const FloatElements& colors) {
    for (std::size_t i = 0; i < colors.count; ++i) {
      if (colors.at(i, 3) < 1) return true;
    }
    return false;
  }

  const Document& document_;
  const tinygltf::Primitive& source_;
  const DracoSource* compressed_;
  std::unique_ptr<DracoMesh> draco_;
  Warnings& warnings_;
  std::size_t vertex_count_ = 0;
};

// True if there are triangles to read; counts what is skipped.
bool is_wanted(const tinygltf::Primitive& source, Warnings& warnings) {
  if (!draws_triangles(source.mode)) {
    if (source.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
      throw Error(fmt::format("its mode {} is unknown", source.mode));
    }
    warnings.count("{} primitives of points or lines were skipped");
    return false;
  }
  if (!source.attributes.contains("POSITION")) {
    warnings.count("{} primitives without positions were skipped");
    return false;
  }
  return true;
}

// Keeps only vertices that a triangle uses, in order: the cost of each placement of a primitive is
// in proportion to its vertices.
void drop_unused_vertices(Primitive& primitive) {
  std::vector<std::uint32_t> kept(primitive.position.size(), kNone);
  for (const Uint3& triangle : primitive.triangle) {
    for (const std::uint32_t vertex : triangle) kept[vertex] = 0;
  }
  std::uint32_t count = 0;
  for (std::uint32_t& vertex : kept) {
    if (vertex != kNone) vertex = count++;
  }
  const auto compact = [&](auto& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (kept[i] != kNone) values[kept[i]] = values[i];
    }
    if (!values.empty()) values.resize(count);
    values.shrink_to_fit();
  };
  compact(primitive.position);
  compact(primitive.normal);
  compact(primitive.base_color_texcoord);
  compact(primitive.emissive_texcoord);
  compact(primitive.lightmap_texcoord);
  compact(primitive.vertex_color);
  for (Uint3& triangle : primitive.triangle) {
    for (std::uint32_t& vertex : triangle) vertex = kept[vertex];
  }
}

const DracoSource* draco_source(const Document& document, std::size_t mesh, std::size_t primitive) {
  const auto found = document.draco.find({mesh, primitive});
  return found == document.draco.end() ? nullptr : &found->second;
}

}  // namespace

void add_triangles(std::size_t& total, std::size_t more) {
  total += more;
  if (total <= kMaxTriangles) return;
  throw Error(fmt::format("more than {} triangles; simplify the scene", kMaxTriangles));
}

std::vector<Primitive> read_primitives(const Document& document, std::size_t mesh,
                                       std::span<const MaterialTexcoords> texcoords,
                                       Warnings& warnings) {
  const tinygltf::Mesh& source = document.model.meshes[mesh];
  std::vector<Primitive> primitives;
  std::size_t triangle_count = 0;
  for (std::size_t i = 0; i < source.primitives.size(); ++i) {
    Primitive primitive;
    primitive.mesh_name = fmt::format("meshes[{}] \"{}\"", mesh, source.name);
    primitive.place = fmt::format("{}, primitives[{}]", primitive.mesh_name, i);
    try {
      if (!is_wanted(source.primitives[i], warnings)) continue;
      const int material = source.primitives[i].material;
      const std::size_t default_material = texcoords.size() - 1;
      primitive.material = static_cast<std::uint32_t>(
          material < 0 ? default_material : static_cast<std::size_t>(material));
      PrimitiveReader(document, source.primitives[i], draco_source(document, mesh, i), warnings)
          .read(texcoords[primitive.material], primitive);
      if (primitive.position.size() > 3 * primitive.triangle.size()) {
        drop_unused_vertices(primitive);
      }
      add_triangles(triangle_count, primitive.triangle.size());
    } catch (const Error& failure) {
      throw Error(fmt::format("{}: {}", primitive.place, failure.what()));
    }
    primitives.push_back(std::move(primitive));
  }
  return primitives;
}

}  // namespace rebounce::gltf
