#pragma once

// What it takes to test that a transfer file is checked: tampering under a good checksum.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "transfer/file/content_hash.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

inline std::size_t prefix_size(const std::string& file) {
  std::uint64_t length = 0;
  std::memcpy(&length, file.data(), sizeof(length));
  return sizeof(length) + length;
}

/// Gives a file that was tampered with the checksum that notes/reference/file_format.md prescribes.
inline void reseal(std::string& file) {
  const std::string entry = "\"checksum\":\"xxh3:";
  const std::size_t digits = file.find(entry);
  if (digits == std::string::npos || digits + entry.size() + 32 > file.size()) return;
  file.replace(digits + entry.size(), 32, 32, '0');
  ContentHash hash;
  hash.update(std::as_bytes(std::span(file)));
  file.replace(digits + entry.size(), 32, hash.text().substr(5));
}

/// Replaces a piece of text in a file by another of its length, under a good checksum.
inline void replace_in_file(const std::filesystem::path& path, const std::string& from,
                            const std::string& to) {
  std::string file = read_bytes(path);
  const std::size_t at = file.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  ASSERT_EQ(from.size(), to.size());
  file.replace(at, from.size(), to);
  reseal(file);
  write_bytes(path, file);
}

/// Uses what was loaded as the runtime does, so that a sanitizer sees an index that got through.
inline void use(const TransferData& data) {
  const FormFactorRows rows(data.exchange, data.patches.area);
  const std::size_t n = data.patches.size();
  std::vector<Float3> result(n);
  std::vector<float> workspace(data.transfer->workspace_size());
  rows.gather(data.patches.reflectance, result);
  data.transfer->apply(data.patches.reflectance, result, workspace);
  for (const Uint3& triangle : data.mesh.triangle) {
    for (const std::uint32_t vertex : triangle) ASSERT_LT(vertex, data.mesh.position.size());
  }
  for (const std::uint32_t patch : data.mesh.weight_patch) ASSERT_LT(patch, n);
}

}  // namespace rebounce::test
