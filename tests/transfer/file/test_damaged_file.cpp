// Files that something else made, or something else changed.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/transfer_file_tampering.h"
#include "tests/transfer/file/transfer_file_samples.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/transfer_file_format.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_damaged_file {
namespace {

using test::expect_error;
using test::prefix_size;
using test::replace_in_file;
using test::reseal;
using test::sample_data;
using test::sample_operator;
using test::use;

TEST(TransferFile, RefusesAnotherVersionWithBothNumbers) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::string entry = "\"format_version\":\"";
  file[file.find(entry) + entry.size()] = '9';
  test::write_bytes(folder / "file",
                    file);  // not sealed again: a version speaks before its checksum
  expect_error([&] { load_transfer_file(folder / "file"); },
               "is of format version 9, and this program reads version " +
                   std::to_string(kFileFormatVersion));
}

TEST(TransferFile, RefusesOtherFiles) {
  const test::TemporaryFolder folder;
  expect_error([&] { load_transfer_file(folder / "none"); }, "cannot read");
  for (const std::string& scene :
       {std::string("glTF\2\0\0\0", 8), std::string("{\"asset\": {}}")}) {
    test::write_bytes(folder / "scene", scene);
    expect_error([&] { load_transfer_file(folder / "scene"); }, "make one of it with precompute");
  }
  write_safetensors(folder / "other", lay_out_safetensors({}, {{"format", "pt"}}));
  expect_error([&] { load_transfer_file(folder / "other"); }, "is not a transfer file");
  write_safetensors(
      folder / "unsealed",
      lay_out_safetensors({}, {{"format", "rebounce transfer"},
                               {"format_version", std::to_string(kFileFormatVersion)}}));
  expect_error([&] { load_transfer_file(folder / "unsealed"); }, "checksum is missing");
}

// Every bit of the prefix, and one bit of every byte of the tensors: the checksum treats those
// alike.
TEST(TransferFile, RefusesAnyFlippedBit) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string file = test::read_bytes(folder / "file");
  const std::size_t prefix = prefix_size(file);
  std::fstream stream(folder / "file", std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at));
    stream.put(byte);
    stream.flush();
  };
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < 8 * file.size(); bit += bit < 8 * prefix ? 1 : 41) {
    const std::size_t at = bit / 8;
    put(at, static_cast<char>(file[at] ^ (1 << bit % 8)));
    try {
      load_transfer_file(folder / "file");
      ADD_FAILURE() << "bit " << bit % 8 << " of byte " << at;
      ++accepted;
    } catch (const Error&) {
    }
    put(at, file[at]);
    ASSERT_LT(accepted, 10U);
  }
  EXPECT_NO_THROW(load_transfer_file(folder / "file")) << "every flip was undone";
}

TEST(TransferFile, RefusesAFileCutShort) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "whole", sample_data());
  const std::string file = test::read_bytes(folder / "whole");
  for (std::size_t size = 0; size < file.size(); size += 97) {
    test::write_bytes(folder / "cut", file.substr(0, size));
    EXPECT_THROW(load_transfer_file(folder / "cut"), Error) << size;
  }
}

/// The bytes of a file whose tensor `name` has lost its rows.
std::string without_rows(const SafetensorsFile& file, const std::string& name) {
  std::vector<TensorView> tensors;
  for (const auto& [each, info] : file.tensors()) {
    TensorView view{each, info.type, info.shape,
                    file.data().subspan(info.begin, info.end - info.begin)};
    if (each == name) {
      view.shape[0] = 0;
      view.bytes = {};
    }
    tensors.push_back(view);
  }
  std::string bytes;
  write_safetensors(
      [&](std::span<const std::byte> piece) {
        bytes.append(reinterpret_cast<const char*>(piece.data()), piece.size());
      },
      lay_out_safetensors(tensors, file.metadata()));
  reseal(bytes);
  return bytes;
}

// Who asks whether a part is empty looks at one tensor, and must not find the others full.
TEST(TransferFile, RefusesPartsWhoseFirstTensorIsEmpty) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "whole", test::full_sample_data());
  const SafetensorsFile whole(folder / "whole");
  for (const char* part :
       {tensor::kRowBegin, tensor::kSkyBegin, tensor::kOpacityMap, tensor::kEmittedIrradiance,
        tensor::kProbePosition, tensor::kProbeSkyBegin, tensor::kSurfaceSky,
        tensor::kSurfaceSkyBegin, tensor::kVertexRows.begin, tensor::kTexelRows.begin}) {
    if (!whole.tensors().contains(part)) {
      ADD_FAILURE() << part << " is not in the file";
      continue;
    }
    test::write_bytes(folder / "damaged", without_rows(whole, part));
    expect_error([&] { load_transfer_file(folder / "damaged"); },
                 std::string("tensor ") + part + ": 0 rows, not at least 1");
  }
}

TEST(TransferFile, RefusesAnOperatorThatDoesNotFit) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.transfer = sample_operator(std::vector<float>(65, 1.0F), Precision::kF16);
  save_transfer_file(folder / "file", data);
  expect_error([&] { load_transfer_file(folder / "file"); },
               "tensor transfer.dense.tiles is F16[1, 3, 64, 64], not F16[any, 1, 64, 64]");

  save_transfer_file(folder / "file", sample_data());
  replace_in_file(folder / "file", "\"operator\":\"dense\"", "\"operator\":\"dance\"");
  expect_error([&] { load_transfer_file(folder / "file"); }, "kind");

  data.transfer = nullptr;
  expect_error([&] { save_transfer_file(folder / "file", data); }, "have no operator");
}

TEST(TransferFile, RefusesNamesThatDoNotFit) {
  const test::TemporaryFolder folder;
  for (const char* damaged : {R"(\"cameras\":{"front\"])", R"(\"cameras\":[1234567])",
                              R"(\"Cameras\":[\"front\"])", R"(\"cameras\":[\"fr\",\"\"])"}) {
    const std::string from = R"(\"cameras\":[\"front\"])";
    std::string to = damaged;
    to.resize(from.size(), ' ');
    save_transfer_file(folder / "file", sample_data());
    replace_in_file(folder / "file", from, to);
    EXPECT_THROW(load_transfer_file(folder / "file"), Error) << damaged;
  }
}

TEST(TransferFile, RefusesAMissingTensorAndAnotherType) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  replace_in_file(folder / "file", "\"mesh.position\"", "\"mesh.positiom\"");
  expect_error([&] { load_transfer_file(folder / "file"); }, "tensor mesh.position is missing");
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::size_t at = file.find("\"F32\"", file.find("\"patch.area\""));
  file[at + 1] = 'U';
  reseal(file);
  test::write_bytes(folder / "file", file);
  expect_error([&] { load_transfer_file(folder / "file"); }, "patch.area is U32[3], not F32[any]");
}

// With the checksum made good after each mutation, nothing but the checks themselves protects.
TEST(TransferFile, SurvivesRandomMutationsUnderAGoodChecksum) {
  constexpr std::uint64_t kSeed = 20240608;
  constexpr int kCount = 4'000;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string whole = test::read_bytes(folder / "file");
  const std::size_t prefix = prefix_size(whole);
  // The tiles come first and are not looked at: the tables behind them are what to aim at.
  const std::size_t tables = prefix + DenseOperator::kTile * DenseOperator::kTile * 2;
  int loaded = 0;
  for (int i = 0; i < kCount; ++i) {
    std::string file = whole;
    const std::size_t begin = i % 2 == 0 ? 0 : tables;
    const std::size_t end = i % 2 == 0 ? prefix : file.size();
    for (std::size_t edits = 1 + random() % 3; edits > 0; --edits) {
      const std::size_t at = begin + random() % (end - begin);
      file[at] = static_cast<char>(random() % 2 ? file[at] ^ (1 << random() % 8) : random());
    }
    reseal(file);
    test::write_bytes(folder / "file", file);
    try {
      use(load_transfer_file(folder / "file"));
      ++loaded;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(loaded, kCount / 50);
  EXPECT_LT(loaded, kCount * 9 / 10);
}

}  // namespace
}  // namespace rebounce::test_damaged_file
