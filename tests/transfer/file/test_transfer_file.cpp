#include "transfer/file/transfer_file_io.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/transfer_file_tampering.h"
#include "tests/transfer/file/transfer_file_samples.h"
#include "transfer/file/safetensors.h"

namespace rebounce::test_transfer_file {
namespace {

using test::expect_equal;
using test::expect_error;
using test::reseal;
using test::sample_data;
using Names = std::vector<std::string>;

TEST(TransferFile, RoundTripsEveryField) {
  for (const Precision precision : {Precision::kF16, Precision::kF32}) {
    const test::TemporaryFolder folder;
    const TransferData data = test::full_sample_data(precision);
    save_transfer_file(folder / "file", data);
    expect_equal(load_transfer_file(folder / "file"), data);
    EXPECT_EQ(folder.names(), Names{"file"});
  }
}

TEST(TransferFile, RoundTripsASceneWithoutMeshTexturesCamerasOrLights) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.mesh = {};
  data.mesh.weight_begin = {0};
  data.materials.clear();
  data.textures.clear();
  data.cameras.clear();
  data.lights.clear();
  data.exchange = {SharedArray(std::vector<std::uint64_t>(4)), {}, {}};
  data.record = {};
  data.settings_json.clear();
  data.report_json.clear();
  save_transfer_file(folder / "file", data);
  expect_equal(load_transfer_file(folder / "file"), data);
}

TEST(TransferFile, LoadedDataWork) {
  const test::TemporaryFolder folder;
  const TransferData data = sample_data();
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  const std::vector<Float3> light(data.patches.size(), {1, 2, 3});
  EXPECT_EQ(product(*loaded.transfer, light), product(*data.transfer, light));
}

TEST(TransferFile, MapsTheLargeTensorsAlignedInsteadOfCopyingThem) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kF32));
  const TransferData data = load_transfer_file(folder / "file");
  const auto& storage = dynamic_cast<const DenseOperator&>(*data.transfer).storage();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(storage.tiles_f32.data()) % 64, 0U);
  EXPECT_EQ(storage.tiles_f32.owner(), data.exchange.column.owner()) << "one mapping for all";
}

TEST(TransferFile, IsTheSameBytesEveryTime) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "first", sample_data());
  save_transfer_file(folder / "second", load_transfer_file(folder / "first"));
  EXPECT_EQ(test::read_bytes(folder / "first"), test::read_bytes(folder / "second"));
}

TEST(TransferFile, SealsAsDocumented) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::string written = file;
  reseal(file);
  EXPECT_EQ(file, written);
}

TEST(TransferFile, IgnoresATensorThatItDoesNotKnow) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const SafetensorsFile known(folder / "file");
  std::vector<TensorView> tensors;
  for (const auto& [name, info] : known.tensors()) {
    tensors.push_back(
        {name, info.type, info.shape, known.data().subspan(info.begin, info.end - info.begin)});
  }
  const std::vector<float> more{1, 2};
  tensors.push_back({"later.addition", TensorType::kF32, {2}, std::as_bytes(std::span(more))});
  write_safetensors(folder / "newer", lay_out_safetensors(tensors, known.metadata()));
  std::string file = test::read_bytes(folder / "newer");
  reseal(file);
  test::write_bytes(folder / "newer", file);
  expect_equal(load_transfer_file(folder / "newer"), sample_data());
}

TEST(TransferFile, LeavesTheTargetAloneWhenItCannotWrite) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string before = test::read_bytes(folder / "file");
  {
    const test::FileSizeLimit limit(8192);
    expect_error([&] { save_transfer_file(folder / "file", sample_data(Precision::kF32)); },
                 "cannot write");
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), before);
  EXPECT_EQ(folder.names(), Names{"file"});
  expect_error([&] { save_transfer_file(folder / "none/file", sample_data()); },
               "create the folder");
}

TEST(TransferFile, AFileMayBeReplacedWhileItIsInUse) {
  const test::TemporaryFolder folder;
  const TransferData data = sample_data(Precision::kF32);
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  save_transfer_file(folder / "file", sample_data(Precision::kF16));
  expect_equal(loaded, data);
}

}  // namespace
}  // namespace rebounce::test_transfer_file
