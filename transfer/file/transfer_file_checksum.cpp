#include "transfer/file/transfer_file_format.h"

namespace rebounce {
namespace {

constexpr std::string_view kHashName = "xxh3:";

}  // namespace

std::string zero_checksum() {
  return std::string(kHashName) + std::string(ContentHash::kDigitCount, '0');
}

std::size_t find_checksum_digits(std::string_view prefix) {
  // In a JSON string the quotes would be escaped, so only the entry itself matches.
  const std::string entry = std::string("\"") + key::kChecksum + "\":\"" + std::string(kHashName);
  const std::size_t found = prefix.find(entry);
  if (found == std::string_view::npos || prefix.find(entry, found + 1) != std::string_view::npos) {
    return std::string_view::npos;
  }
  const std::size_t digits = found + entry.size();
  return prefix.size() - digits >= ContentHash::kDigitCount ? digits : std::string_view::npos;
}

FileChecksum::FileChecksum(std::string_view prefix, std::size_t digits) {
  const auto bytes = std::as_bytes(std::span(prefix));
  const std::string zeros(ContentHash::kDigitCount, '0');
  hash_.update(bytes.first(digits));
  hash_.update(std::as_bytes(std::span(zeros)));
  hash_.update(bytes.subspan(digits + zeros.size()));
}

}  // namespace rebounce
