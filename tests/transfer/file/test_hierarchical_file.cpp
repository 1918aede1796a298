// The hierarchical operator in a transfer file.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>

#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/plain_data.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/transfer_file_tampering.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test_hierarchical_file {
namespace {

using test::expect_error;

constexpr std::size_t kPatchCount = 100;

TransferData sample_data(Precision precision, const PatchRoles& roles = {}) {
  HierarchicalStorage storage = test::random_hierarchical_storage(kPatchCount, 2, 5);
  storage.roles = roles;
  if (precision != Precision::kF32) storage = encode_values(storage, precision);
  TransferData data = test::plain_data(storage.area);
  data.transfer = std::make_shared<const HierarchicalOperator>(std::move(storage));
  return data;
}

/// With cluster coefficients.
TransferData nested_data(Precision precision) {
  TransferData data = sample_data(precision);
  data.transfer = std::make_shared<const HierarchicalOperator>(
      encode_values(test::random_nested_storage(kPatchCount, 2, 5), precision));
  return data;
}

/// With scales of positions.
TransferData equilibrated_data(Precision precision) {
  TransferData data = sample_data(precision);
  data.transfer = std::make_shared<const HierarchicalOperator>(encode_values(
      test::equilibrated(test::random_nested_storage(kPatchCount, 2, 5), 6), precision));
  return data;
}

const HierarchicalStorage& storage_of(const TransferData& data) {
  return dynamic_cast<const HierarchicalOperator&>(*data.transfer).storage();
}

void check_round_trip(const TransferData& data) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  const auto &a = storage_of(data), &b = storage_of(loaded);
  EXPECT_EQ(a.area, b.area);
  EXPECT_EQ(a.patch, b.patch);
  EXPECT_EQ(a.channel_matrix, b.channel_matrix);
  EXPECT_EQ(a.matrix_count, b.matrix_count);
  EXPECT_EQ(a.precision, b.precision);
  EXPECT_EQ(a.coefficient_scale, b.coefficient_scale);
  EXPECT_EQ(a.scale_exponent, b.scale_exponent);
  EXPECT_TRUE(std::ranges::equal(a.values_f32, b.values_f32));
  EXPECT_TRUE(std::ranges::equal(a.values_f16, b.values_f16));
  EXPECT_TRUE(std::ranges::equal(a.bases_q8, b.bases_q8));
  EXPECT_TRUE(std::ranges::equal(a.packed_couplings, b.packed_couplings));
  EXPECT_EQ(a.row_format, b.row_format);
  std::vector<float> expanded_a(kPatchCount * kPatchCount), expanded_b(expanded_a);
  data.transfer->expand(1, expanded_a);
  loaded.transfer->expand(1, expanded_b);
  EXPECT_EQ(expanded_a, expanded_b);
  save_transfer_file(folder / "again", loaded);
  EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
}

TEST(HierarchicalFile, RoundTripsWithAndWithoutClusterBasesAndScales) {
  for (const Precision precision : {Precision::kF16, Precision::kF32, Precision::kQ8}) {
    check_round_trip(sample_data(precision));
    const TransferData nested = nested_data(precision);
    EXPECT_EQ(storage_of(nested).coefficient_scale.size(), 16U);
    check_round_trip(nested);
    const TransferData equilibrated = equilibrated_data(precision);
    EXPECT_EQ(storage_of(equilibrated).scale_exponent.size(), kPatchCount);
    check_round_trip(equilibrated);
  }
}

TEST(HierarchicalFile, SaysNothingOfClusterBasesAndScalesWhereThereAreNone) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kQ8));
  const SafetensorsFile file(folder / "file");
  EXPECT_FALSE(file.tensors().contains("transfer.hierarchical.moment_scale"));
  EXPECT_FALSE(file.tensors().contains("transfer.hierarchical.scale_exponent"));
}

/// Each of the four roles in turn.
PatchRoles all_roles() {
  PatchRoles roles;
  for (std::size_t i = 0; i < kPatchCount; ++i) roles.role.push_back(i % 4);
  return roles;
}

TEST(HierarchicalFile, HoldsReceiversAndSources) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kQ8, all_roles()));
  const TransferData loaded = load_transfer_file(folder / "file");
  EXPECT_EQ(loaded.transfer->roles(), all_roles());
  save_transfer_file(folder / "again", loaded);
  EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
}

TEST(HierarchicalFile, SaysNothingOfRolesWhereEveryPatchHasBoth) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kQ8));
  EXPECT_FALSE(SafetensorsFile(folder / "file").tensors().contains("transfer.hierarchical.role"));
  EXPECT_TRUE(load_transfer_file(folder / "file").transfer->roles().all_are_both());
}

TEST(HierarchicalFile, MapsTheValuesInsteadOfCopyingThem) {
  for (const Precision precision : {Precision::kF16, Precision::kQ8}) {
    const test::TemporaryFolder folder;
    save_transfer_file(folder / "file", sample_data(precision));
    const TransferData data = load_transfer_file(folder / "file");
    const auto& owner = data.exchange.row_begin.owner();
    EXPECT_EQ(storage_of(data).values_f16.owner(), owner);
    if (precision == Precision::kQ8) {
      EXPECT_EQ(storage_of(data).bases_q8.owner(), owner);
      EXPECT_EQ(storage_of(data).packed_couplings.owner(), owner);
    }
  }
}

std::shared_ptr<const HierarchicalOperator> sample_form_factors(std::uint32_t matrix_count) {
  const HierarchicalStorage storage =
      test::equilibrated(test::random_hierarchical_storage(kPatchCount, matrix_count, 5), 6);
  return std::make_shared<const HierarchicalOperator>(encode_values(storage, Precision::kF16));
}

TEST(HierarchicalFile, HoldsCompressedFormFactorsBesideTheOperator) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kF32);
  save_transfer_file(folder / "without", data);
  EXPECT_EQ(load_transfer_file(folder / "without").compressed_form_factors, nullptr);
  data.compressed_form_factors = sample_form_factors(1);
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  ASSERT_NE(loaded.compressed_form_factors, nullptr);
  const auto& a = data.compressed_form_factors->storage();
  const auto& b = loaded.compressed_form_factors->storage();
  EXPECT_EQ(a.patch, b.patch);
  EXPECT_EQ(a.blocks.size(), b.blocks.size());
  EXPECT_FALSE(b.scale_exponent.empty());
  EXPECT_EQ(a.scale_exponent, b.scale_exponent);
  EXPECT_TRUE(std::ranges::equal(a.values_f16, b.values_f16));
  EXPECT_EQ(b.values_f16.owner(), loaded.exchange.row_begin.owner());  // mapped, not copied
  save_transfer_file(folder / "again", loaded);
  EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
}

TEST(HierarchicalFile, HoldsFormFactorsThatAreCompressedOnly) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kF32);
  data.exchange = {};
  data.compressed_form_factors = sample_form_factors(1);
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  EXPECT_TRUE(loaded.exchange.empty());
  EXPECT_EQ(loaded.exchange.patch_count(), 0U);
  ASSERT_NE(loaded.compressed_form_factors, nullptr);
  EXPECT_TRUE(std::ranges::equal(data.compressed_form_factors->storage().values_f16,
                                 loaded.compressed_form_factors->storage().values_f16));
  save_transfer_file(folder / "again", loaded);
  EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
}

TEST(HierarchicalFile, NeedsNoFormFactors) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kF32);
  data.exchange = {};
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  EXPECT_TRUE(loaded.exchange.empty());
  EXPECT_EQ(loaded.compressed_form_factors, nullptr);
  save_transfer_file(folder / "again", loaded);
  EXPECT_EQ(test::read_bytes(folder / "file"), test::read_bytes(folder / "again"));
}

TEST(HierarchicalFile, RefusesFormFactorsThatDifferByChannel) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kF32);
  data.compressed_form_factors = sample_form_factors(2);
  save_transfer_file(folder / "file", data);
  expect_error([&] { load_transfer_file(folder / "file"); }, "more than one matrix");
}

/// The file's tensors with one of them changed by hand, under a good checksum.
class Tampering {
 public:
  explicit Tampering(const std::filesystem::path& path) : path_(path), file_(path) {
    for (const auto& [name, info] : file_.tensors()) {
      const auto bytes = file_.data().subspan(info.begin, info.end - info.begin);
      tensors_.push_back({name, info.type, info.shape, bytes});
    }
  }

  void set(const std::string& name, std::size_t entry, std::uint32_t value) {
    for (TensorView& tensor : tensors_) {
      if (tensor.name != "transfer.hierarchical." + name) continue;
      changed_.assign(tensor.bytes.begin(), tensor.bytes.end());
      ASSERT_LE((entry + 1) * sizeof(value), changed_.size());
      std::memcpy(changed_.data() + entry * sizeof(value), &value, sizeof(value));
      tensor.bytes = changed_;
    }
    ASSERT_FALSE(changed_.empty()) << name;
    write();
  }

  /// Leaves the last byte of a tensor of bytes out.
  void shorten(const std::string& name) {
    for (TensorView& tensor : tensors_) {
      if (tensor.name != "transfer.hierarchical." + name) continue;
      tensor.bytes = tensor.bytes.first(tensor.bytes.size() - 1);
      tensor.shape = {tensor.bytes.size()};
    }
    write();
  }

 private:
  void write() {
    write_safetensors(path_, lay_out_safetensors(tensors_, file_.metadata()));
    std::string bytes = test::read_bytes(path_);
    test::reseal(bytes);
    test::write_bytes(path_, bytes);
  }

  std::filesystem::path path_;
  SafetensorsFile file_;
  std::vector<TensorView> tensors_;
  std::vector<std::byte> changed_;
};

/// An entry of a tensor that becomes another, and what is said of it.
struct Fault {
  const char* tensor;
  std::size_t entry;
  std::uint32_t value;
  const char* message;
};

void expect_refused(const TransferData& data, const std::vector<Fault>& faults) {
  const test::TemporaryFolder folder;
  for (const Fault& fault : faults) {
    SCOPED_TRACE(std::string(fault.tensor) + ": " + fault.message);
    save_transfer_file(folder / "file", data);
    Tampering(folder / "file").set(fault.tensor, fault.entry, fault.value);
    expect_error([&] { load_transfer_file(folder / "file"); }, fault.message);
  }
}

TEST(HierarchicalFile, RefusesTablesThatDoNotFit) {
  expect_refused(sample_data(Precision::kF16, all_roles()),
                 {
                     {"blocks", 0, 16, "nor below"},
                     {"blocks", 0, 0xFFFFFFF0, "reaches outside"},
                     {"blocks", 1, 0, "empty"},
                     {"blocks", 1, 8, "not aligned"},
                     {"blocks", 3, 0xFFFFFFF0, "reaches outside"},
                     {"blocks", 4, 2, "not numbered in the order"},
                     {"blocks", 4, 3, "unknown kind"},
                     {"blocks", 4, 0xFFFFFFFF, "unknown kind"},
                     {"blocks", 5, 1000, "rank"},
                     {"blocks", 5, 0, "rank"},
                     {"blocks", 6, 0xFFFFFFFF, "rank"},
                     {"channel_matrix", 2, 3, "a channel has no matrix"},
                     {"channel_matrix", 2, 2, "number of values"},
                     {"patch", 0, kPatchCount, "not a permutation"},
                     {"patch", 0, 0xFFFFFFFF, "not a permutation"},
                     {"role", 7, 0x03040303, "role of patch 30 is 4"},
                     {"role", 24, 0xFF030303, "role of patch 99 is 255"},
                 });
}

TEST(HierarchicalFile, RefusesRolesThatAreNotOneForEachPatch) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kF16, all_roles()));
  Tampering(folder / "file").shorten("role");
  expect_error([&] { load_transfer_file(folder / "file"); }, "transfer.hierarchical.role");
}

TEST(HierarchicalFile, RefusesClusterBasesThatDoNotFit) {
  expect_refused(nested_data(Precision::kQ8),
                 {{"blocks", 0, 112, "a cluster basis is not over positions"},
                  {"blocks", 2, 0, "not numbered in the order"},
                  {"blocks", 3, 0xFFFFFFF0, "not numbered in the order"},
                  {"blocks", 4, 1, "not numbered in the order"},
                  {"blocks", 5, 6, "rank of a cluster basis"},
                  {"moment_scale", 3, 0x7FC00000, "not finite"},
                  {"moment_scale", 3, 0x7F800000, "not finite"}});
}

TEST(HierarchicalFile, RefusesFormatsOfRowsThatDoNotFit) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kQ8));
  Tampering(folder / "file").shorten("row_format");
  expect_error([&] { load_transfer_file(folder / "file"); }, "one format for each row");
  expect_refused(sample_data(Precision::kQ8), {{"row_format", 0, 0x40404040, "number of values"}});
}

TEST(HierarchicalFile, RefusesScalesThatDoNotFit) {
  expect_refused(equilibrated_data(Precision::kQ8),
                 {{"scale_exponent", 3, 0x00001900, "beyond 2^+-24"}});
}

TEST(HierarchicalFile, RefusesFormFactorsWithClusterBases) {
  const auto nested = std::make_shared<const HierarchicalOperator>(
      encode_values(test::random_nested_storage(kPatchCount, 1, 5), Precision::kF16));
  expect_error([&] { CompressedFormFactors{nested}; }, "bases are nested");
}

/// Changes single bytes of a tensor. At most `most_loaded` of the files may be taken for good.
void survive_mutations(const TransferData& data, const char* tensor, double most_loaded = 0.9) {
  constexpr std::uint64_t kSeed = 20240609;
  constexpr int kCount = 1'000;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", data);
  const std::string whole = test::read_bytes(folder / "file");
  const SafetensorsFile file(folder / "file");
  const TensorInfo& blocks = file.info(tensor);
  const std::size_t begin = test::prefix_size(whole) + blocks.begin;
  int loaded = 0;
  for (int i = 0; i < kCount; ++i) {
    std::string bytes = whole;
    const std::size_t at = begin + random() % (blocks.end - blocks.begin);
    bytes[at] = static_cast<char>(random() % 2 ? bytes[at] ^ (1 << random() % 8) : random());
    test::reseal(bytes);
    test::write_bytes(folder / "mutant", bytes);
    try {
      test::use(load_transfer_file(folder / "mutant"));
      ++loaded;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(loaded, 0);
  EXPECT_LE(loaded, kCount * most_loaded);
}

TEST(HierarchicalFile, SurvivesRandomMutationsUnderAGoodChecksum) {
  for (const bool nested : {false, true}) {
    SCOPED_TRACE(nested ? "nested" : "plain");
    survive_mutations(nested ? nested_data(Precision::kQ8) : sample_data(Precision::kF16),
                      "transfer.hierarchical.blocks");
  }
  // Every byte is a format, and the padding of the rows hides small changes of their size.
  survive_mutations(nested_data(Precision::kQ8), "transfer.hierarchical.row_format", 1);
}

TEST(FormFactorFile, IsReadByTheTransferFileThatItWasWrittenWith) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kQ8);
  data.settings_json = R"({"seed":1})";
  expect_error([&] { save_form_factor_file(folder / "none", data); }, "no compressed form factors");
  data.compressed_form_factors = sample_form_factors(1);
  save_form_factor_file(folder / "form_factors", data);
  const SafetensorsFile file(folder / "form_factors");

  TransferData rest = sample_data(Precision::kQ8);
  rest.settings_json = data.settings_json;
  const auto read = read_form_factor_file(file, rest);
  std::vector<float> expected(kPatchCount * kPatchCount), found(expected);
  data.compressed_form_factors->expand(0, expected);
  read->expand(0, found);
  EXPECT_EQ(found, expected);

  rest.settings_json = R"({"seed":2})";
  expect_error([&] { read_form_factor_file(file, rest); }, "another settings");
  expect_error([&] { read_transfer_file(file); }, "not a transfer file");
  save_transfer_file(folder / "transfer", rest);
  expect_error([&] { read_form_factor_file(SafetensorsFile(folder / "transfer"), rest); },
               "not a file of form factors");
}

TEST(FormFactorFile, IsRefusedWhenItIsDamaged) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data(Precision::kQ8);
  data.compressed_form_factors = sample_form_factors(1);
  save_form_factor_file(folder / "file", data);
  std::string bytes = test::read_bytes(folder / "file");
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  test::write_bytes(folder / "file", bytes);
  expect_error([&] { read_form_factor_file(SafetensorsFile(folder / "file"), data); }, "checksum");
}

}  // namespace
}  // namespace rebounce::test_hierarchical_file
