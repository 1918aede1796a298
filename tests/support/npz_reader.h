#pragma once

// Reads back what npz_writer.h writes, without its help.

#include <gtest/gtest.h>
#include <zip.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace rebounce::test {

/// The files of a zip, each checked against its CRC by libzip.
inline std::map<std::string, std::string> unzip(const std::filesystem::path& path) {
  std::map<std::string, std::string> files;
  int error = 0;
  const std::unique_ptr<zip_t, decltype(&zip_discard)> archive(
      zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &error), &zip_discard);
  EXPECT_NE(archive, nullptr) << error;
  for (zip_int64_t i = 0; archive && i < zip_get_num_entries(archive.get(), 0); ++i) {
    zip_stat_t stat;
    EXPECT_EQ(zip_stat_index(archive.get(), i, 0, &stat), 0);
    EXPECT_EQ(stat.comp_method, ZIP_CM_STORE);
    std::string bytes(stat.size, '\0');
    zip_file_t* file = zip_fopen_index(archive.get(), i, 0);
    EXPECT_EQ(zip_fread(file, bytes.data(), bytes.size()), static_cast<zip_int64_t>(stat.size));
    EXPECT_EQ(zip_fclose(file), 0);
    files[stat.name] = bytes;
  }
  return files;
}

struct Npy {
  int version = 0;
  std::string header;
  std::string data;
};

/// One array in the npy format; its header without the padding.
inline Npy parse_npy(const std::string& bytes) {
  EXPECT_EQ(bytes.substr(0, 6), "\x93NUMPY");
  Npy npy;
  npy.version = static_cast<unsigned char>(bytes.at(6));
  const int length_size = npy.version == 1 ? 2 : 4;
  std::size_t length = 0;
  for (int i = 0; i < length_size; ++i) {
    length |= static_cast<std::size_t>(static_cast<unsigned char>(bytes.at(8 + i))) << (8 * i);
  }
  const std::size_t begin = 8 + length_size;
  EXPECT_EQ((begin + length) % 64, 0U);
  npy.header = bytes.substr(begin, length);
  npy.data = bytes.substr(begin + length);
  EXPECT_EQ(npy.header.back(), '\n');
  npy.header.resize(npy.header.find_last_not_of(" \n") + 1);
  return npy;
}

/// The values of one array of an .npz file, in the order of the file; `descr` is NumPy's name of
/// type T.
template <typename T>
std::vector<T> npz_values(const std::map<std::string, std::string>& files, const std::string& name,
                          const std::string& descr) {
  const Npy npy = parse_npy(files.at(name + ".npy"));
  EXPECT_NE(npy.header.find("'" + descr + "'"), std::string::npos) << name << ": " << npy.header;
  std::vector<T> values(npy.data.size() / sizeof(T));
  std::memcpy(values.data(), npy.data.data(), npy.data.size());
  return values;
}

}  // namespace rebounce::test
