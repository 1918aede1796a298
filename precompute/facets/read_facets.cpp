#include "precompute/facets/read_facets.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "precompute/import/file_extension.h"
#include "precompute/import/text_file.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

constexpr std::size_t kStlHeader = 84, kStlTriangle = 50, kStlNormal = 12;

/// The words of a text file, line by line.
class TextLines {
 public:
  TextLines(const std::filesystem::path& path, std::string_view text) : path_(path), text_(text) {}

  /// Moves on to the next line; false at the end.
  bool next() {
    if (text_.empty()) return false;
    const std::size_t end = std::min(text_.find('\n'), text_.size());
    line_ = text_.substr(0, end);
    text_.remove_prefix(std::min(end + 1, text_.size()));
    ++number_;
    return true;
  }

  /// The next word of the line; empty at its end.
  std::string_view word() {
    constexpr std::string_view kBlank = " \t\r,";
    line_.remove_prefix(std::min(line_.find_first_not_of(kBlank), line_.size()));
    const std::string_view found = line_.substr(0, line_.find_first_of(kBlank));
    line_.remove_prefix(found.size());
    return found;
  }

  template <typename Number>
  Number number() {
    std::string_view text = word();
    if (text.starts_with('+')) text.remove_prefix(1);
    return parse<Number>(text);
  }

  template <typename Number>
  Number parse(std::string_view text) const {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail(text.empty() ? "a number is missing" : fmt::format("\"{}\" is no number", text));
    }
    return value;
  }

  glm::dvec3 point() {
    const auto x = number<double>(), y = number<double>();
    return {x, y, number<double>()};
  }

  [[noreturn]] void fail(const std::string& reason) const {
    throw Error(fmt::format("{}, line {}: {}", path_.string(), number_, reason));
  }

 private:
  const std::filesystem::path& path_;
  std::string_view text_, line_;
  std::size_t number_ = 0;
};

void add_triangle(Facets& facets, const std::array<glm::dvec3, 3>& corner) {
  const auto first = static_cast<std::uint32_t>(facets.vertex.size());
  facets.vertex.insert(facets.vertex.end(), corner.begin(), corner.end());
  facets.add(std::array{first, first + 1, first + 2});
}

/// The triangles of a binary STL file, or nothing if its size is not that of one.
std::optional<Facets> parse_binary_stl(std::string_view bytes) {
  if (bytes.size() < kStlHeader) return {};
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kStlHeader - sizeof(count), sizeof(count));
  if (bytes.size() < kStlHeader + std::size_t{count} * kStlTriangle) return {};
  // Programs write "solid" to binary files too, but text does not end where its count says.
  if (bytes.starts_with("solid") && bytes.size() != kStlHeader + count * kStlTriangle) return {};
  Facets facets;
  for (std::size_t t = 0; t < count; ++t) {
    std::array<float, 9> xyz;
    std::memcpy(xyz.data(), bytes.data() + kStlHeader + t * kStlTriangle + kStlNormal, sizeof(xyz));
    add_triangle(facets, {glm::dvec3(xyz[0], xyz[1], xyz[2]), glm::dvec3(xyz[3], xyz[4], xyz[5]),
                          glm::dvec3(xyz[6], xyz[7], xyz[8])});
  }
  return facets;
}

Facets parse_text_stl(TextLines lines) {
  Facets facets;
  std::array<glm::dvec3, 3> corner;
  std::size_t count = 0;
  bool inside = false;  // a facet
  while (lines.next()) {
    const std::string_view word = lines.word();
    if (word == "facet" || word == "vertex") inside = true;
    if (word == "vertex") {
      if (count == 3) lines.fail("a facet has more than three corners");
      corner[count++] = lines.point();
    } else if (word == "endfacet") {
      if (count != 3) lines.fail("a facet has fewer than three corners");
      add_triangle(facets, corner);
      count = 0;
      inside = false;
    }
  }
  if (inside) lines.fail("the file ends inside a facet; get a complete copy");
  return facets;
}

Facets parse_obj(TextLines lines) {
  Facets facets;
  std::vector<std::uint32_t> corners;
  while (lines.next()) {
    const std::string_view word = lines.word();
    if (word == "v") facets.vertex.push_back(lines.point());
    if (word != "f") continue;
    corners.clear();
    for (std::string_view corner = lines.word(); !corner.empty(); corner = lines.word()) {
      const auto index = lines.parse<std::int64_t>(corner.substr(0, corner.find('/')));
      const auto count = static_cast<std::int64_t>(facets.vertex.size());
      const std::int64_t place = index < 0 ? count + index : index - 1;
      if (place < 0 || place >= count) lines.fail(fmt::format("there is no vertex {}", corner));
      corners.push_back(static_cast<std::uint32_t>(place));
    }
    if (corners.size() < 3) lines.fail("a face has fewer than three corners");
    facets.add(corners);
  }
  return facets;
}

/// G. N. Walton, "Calculation of obstructed view factors by adaptive integration", NISTIR 6925
/// (2002), appendix: the input of View3D.
Facets parse_vs3(TextLines lines) {
  Facets facets;
  std::uint32_t surface_count = 0;
  while (lines.next()) {
    const std::string_view word = lines.word();
    if (word.empty()) continue;
    if (word[0] == 'E' || word[0] == 'e') break;  // End of data
    if (word == "F" || word == "f") {
      const std::string_view dimensions = lines.word();
      if (!dimensions.starts_with('3')) lines.fail("only geometry in three dimensions is read");
    } else if (word == "V" || word == "v") {
      if (lines.number<std::size_t>() != facets.vertex.size() + 1) {
        lines.fail("vertices are not numbered 1, 2, 3 ...");
      }
      facets.vertex.push_back(lines.point());
    } else if (word == "S" || word == "s" || word == "O" || word == "o") {
      if (lines.number<std::size_t>() != ++surface_count) {
        lines.fail("surfaces are not numbered 1, 2, 3 ...");
      }
      std::vector<std::uint32_t> corners;
      for (int k = 0; k < 4; ++k) {
        const auto v = lines.number<std::uint32_t>();
        if (v > facets.vertex.size()) lines.fail(fmt::format("there is no vertex {}", v));
        if (v > 0) corners.push_back(v - 1);
      }
      if (corners.size() < 3) lines.fail("a surface has fewer than three corners");
      const bool obstructs = word == "O" || word == "o";
      // Of the rest, which an obstruction may leave out, only the emissivity is used.
      const std::string_view base = lines.word(), combined = lines.word(),
                             emissivity = lines.word();
      if (!obstructs &&
          ((!base.empty() && base != "0") || (!combined.empty() && combined != "0"))) {
        lines.fail("surfaces that are parts of others or combined with them are not read");
      }
      facets.add(corners);
      facets.obstructs_only.push_back(obstructs ? 1 : 0);
      facets.emissivity.push_back(
          obstructs || emissivity.empty() ? 1 : lines.parse<double>(emissivity));
    }
  }
  return facets;
}

}  // namespace

Facets read_facets(const std::filesystem::path& path) {
  const std::string kind = lower_case_extension(path);
  if (kind != ".stl" && kind != ".obj" && kind != ".vs3") {
    throw Error(path.string() + ": not a file of facets; give an .stl, .obj or .vs3 file");
  }
  const std::string text = read_text_file(path);
  const TextLines lines(path, text);
  Facets facets;
  if (kind == ".stl") {
    std::optional<Facets> binary = parse_binary_stl(text);
    facets = binary ? std::move(*binary) : parse_text_stl(lines);
  } else {
    facets = kind == ".obj" ? parse_obj(lines) : parse_vs3(lines);
  }
  if (facets.size() == 0) throw Error(path.string() + " has no facets");
  try {
    check_facets(facets);
  } catch (const Error& error) {
    throw Error(path.string() + ": " + error.what());
  }
  return facets;
}

}  // namespace rebounce
