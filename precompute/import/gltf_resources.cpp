#include "precompute/import/gltf_resources.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cctype>
#include <string_view>

#include "precompute/import/gltf_container.h"
#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

// Data URIs can be megabytes long; a message shows the beginning.
std::string shown(const std::string& uri) {
  constexpr std::size_t kShownCharacters = 80;
  return uri.size() <= kShownCharacters ? uri : uri.substr(0, kShownCharacters) + "...";
}

bool is_data_uri(const std::string& uri) {
  return uri.starts_with("data:");
}

int hex_digit(char character) {
  if (character >= '0' && character <= '9') return character - '0';
  const int lower = std::tolower(static_cast<unsigned char>(character));
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::string percent_decoded(const std::string& uri) {
  std::string decoded;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool escape = uri[i] == '%' && i + 2 < uri.size();
    const int high = escape ? hex_digit(uri[i + 1]) : -1;
    const int low = escape ? hex_digit(uri[i + 2]) : -1;
    if (high >= 0 && low >= 0) {
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      decoded += uri[i];
    }
  }
  return decoded;
}

// A colon before the first slash ends a scheme (RFC 3986) or a drive letter.
bool has_scheme(const std::string& uri) {
  const auto colon = uri.find(':');
  return colon != std::string::npos && colon < uri.find('/');
}

bool leaves(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code error;
  const auto real_file = std::filesystem::weakly_canonical(file, error);
  if (error) throw Error("the system cannot look for it: " + error.message());
  const auto relative = real_file.lexically_relative(std::filesystem::weakly_canonical(folder));
  return relative.empty() || *relative.begin() == "..";
}

// The file of a relative reference.
std::filesystem::path contained_path(const std::filesystem::path& folder, const std::string& uri) {
  const std::string decoded = percent_decoded(uri);
  const bool absolute = std::filesystem::path(decoded).is_absolute();
  if (decoded.empty() || decoded.find('\0') != std::string::npos || absolute || has_scheme(uri) ||
      decoded.find('\\') != std::string::npos || leaves(folder, folder / decoded)) {
    throw Error(fmt::format(
        "the URI \"{}\" is refused: only relative paths inside the file's own folder are read",
        shown(uri)));
  }
  return folder / decoded;
}

std::vector<std::uint8_t> decode_data_uri(const std::string& uri) {
  // tinygltf knows no WebP, and images are told apart by their content.
  constexpr std::string_view kWebp = "data:image/webp;base64,";
  if (uri.starts_with(kWebp)) {
    return decode_data_uri("data:image/png;base64," + uri.substr(kWebp.size()));
  }
  std::vector<std::uint8_t> bytes;
  std::string mime_type;
  if (!tinygltf::IsDataURI(uri) || !tinygltf::DecodeDataURI(&bytes, mime_type, uri, 0, false)) {
    throw Error(
        fmt::format("the data URI \"{}\" is empty, not base64, or of an unknown type", shown(uri)));
  }
  return bytes;
}

}  // namespace

void check_uri(const std::filesystem::path& folder, const std::string& uri) {
  if (!is_data_uri(uri)) contained_path(folder, uri);
}

Resource read_resource(const std::filesystem::path& folder, const std::string& uri) {
  if (is_data_uri(uri)) return {decode_data_uri(uri), false};
  const auto path = contained_path(folder, uri);
  try {
    return {read_file(path), true};
  } catch (const Error& failure) {
    throw Error(fmt::format("\"{}\": {}", shown(uri), failure.what()));
  }
}

}  // namespace rebounce::gltf
